"""A scene that is hard on the offsets of shadow rays, of any size and at any place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mlrt_plugin.scene_arrays import Camera, Emitter, Film, Lighting, SceneArrays
from mlrt_plugin.shape_arrays import Shape

LIGHTS = ("point", "area", "directional")
Doubles = npt.NDArray[np.float64]
Triangles = npt.NDArray[np.float64]  # (N, 3, 3)

THIN = 1e-3
"""How thick the wall is that stands free, how wide the gap below the ball and that between
the panel and the card. The scene measures 8."""
FLAP = 2e-4
"""The height of the sheet above the floor."""


@dataclass(frozen=True)
class Placement:
    """Where the scene lies: p becomes size * (p + shift * (1, 1, 1))."""

    size: float = 1.0
    shift: float = 0.0

    @property
    def name(self) -> str:
        return f"{self.size:g}" + (f", moved by {self.shift:g}" if self.shift else "")


def quad(corner: Doubles, u: Doubles, v: Doubles) -> Triangles:
    return np.array(
        [[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]]
    )


def box(lo: Doubles, hi: Doubles) -> Triangles:
    x, y, z = np.diag(hi - lo)
    lower = [quad(lo, y, x), quad(lo, x, z), quad(lo, z, y)]
    return np.concatenate(
        [*lower, *(quad(hi, -a, -b) for a, b in ((x, y), (z, x), (y, z)))]
    )


def ball(center: Doubles, radius: float, subdivisions: int) -> Triangles:
    """An octahedron whose faces are parted again and again."""
    x, y, z = np.eye(3)
    faces = [[sx * x, sy * y, sz * z] for sx in (1, -1) for sy in (1, -1) for sz in (1, -1)]
    triangles = np.array(faces)
    for _ in range(subdivisions):
        a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
        d, e, f = a + b, b + c, c + a
        parts = [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
        triangles /= np.linalg.norm(triangles, axis=2, keepdims=True)
    return center + radius * triangles


def turned() -> Doubles:
    """A rotation after which no plane of the scene is that of two axes."""
    a, b = np.radians(33.0), np.radians(21.0)
    about_z = [[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]]
    about_x = [[1, 0, 0], [0, np.cos(b), -np.sin(b)], [0, np.sin(b), np.cos(b)]]
    return np.array(about_x) @ np.array(about_z)


def solids(subdivisions: int) -> Triangles:
    """A corner of a room with a ball that almost touches the floor, a thin wall, and a
    sheet closely above the floor; z is up."""
    v = np.array
    return np.concatenate(
        [
            quad(v([-4.0, -4, 0]), v([8.0, 0, 0]), v([0, 8.0, 0])),
            quad(v([-4.0, -4, 0]), v([0, 8.0, 0]), v([0, 0, 4.0])),
            quad(v([-4.0, 4, 0]), v([8.0, 0, 0]), v([0, 0, 4.0])),
            box(v([0.6, -2.0, 0]), v([0.6 + THIN, 1.5, 1.6])),
            quad(v([-2.6, -2.2, FLAP]), v([1.2, 0.3, 0]), v([-0.3, 1.0, 0])),
            ball(v([-1.0, 0.2, 0.8 + THIN]), 0.8, subdivisions),
        ]
    )


PANEL = np.array([[1.6, -1.9, 3.0], [0.9, 0.0, 0.0], [0.0, 0.7, 0.0]])
"""The area light: a corner and two edges; it glows downwards."""
CARD = np.array([[1.6, -1.9, 3.0 - THIN], [0.3, 0.0, 0.0], [0.0, 0.7, 0.0]])
"""Covers a third of the panel."""
LAMP = np.array([2.1, -1.4, 3.0])
DOWN = np.array([-0.45, 0.35, -0.82])
EYE, AIM = np.array([-1.6, -6.5, 3.4]), np.array([0.0, 0.1, 0.6])


def hard_scene(
    light: str, placement: Placement, resolution: int, subdivisions: int = 3
) -> SceneArrays:
    """Everything is diffuse, grey and on both sides the same; one light."""
    rotation = turned()

    def placed(points: Doubles) -> npt.NDArray[np.float32]:
        moved = (points @ rotation.T + placement.shift) * placement.size
        return moved.astype(np.float32)

    def direction(vector: Doubles) -> tuple[float, float, float]:
        x, y, z = rotation @ (vector / np.linalg.norm(vector))
        return float(x), float(y), float(z)

    triangles = solids(subdivisions)
    count = len(triangles)
    if light == "area":
        corner, u, v = PANEL
        panel = np.array([[corner, corner + v, corner + u],
                          [corner + v, corner + v + u, corner + u]])  # fmt: skip
        triangles = np.concatenate([triangles, quad(*CARD), panel])
    vertices = placed(triangles.reshape(-1, 3))
    shapes = [Shape(0, count, 0)]
    if light == "area":
        # As the rectangle samples it: a corner and differences of vertices.
        first = vertices[-6]
        edge_u, edge_v = vertices[-5] - first, vertices[-4] - first
        shapes = [Shape(0, count + 2, 0), Shape(count + 2, 2, 0, emitter=0)]
        emitter = Emitter(
            "area",
            (1.0, 1.0, 1.0),
            shape=1,
            rectangle=True,
            corner=triple(first),
            edge_u=triple(edge_u),
            edge_v=triple(edge_v),
        )
    elif light == "point":
        power = 10 * placement.size**2
        position = triple(placed(LAMP[None])[0])
        emitter = Emitter("point", (power, power, power), position=position)
    else:
        emitter = Emitter("directional", (2.0, 2.0, 2.0), direction=direction(DOWN))

    forward = np.array(direction(AIM - EYE))
    up = np.array(direction(np.array([0.0, 0.0, 1.0])))
    left = np.cross(up, forward)
    left /= np.linalg.norm(left)
    camera = Camera(
        origin=triple(placed(EYE[None])[0]),
        axes=(triple(left), triple(np.cross(forward, left)), triple(forward)),
        tan_half_fov_x=0.42,
        near_clip=0.01 * placement.size,
        far_clip=100 * placement.size,
    )
    return SceneArrays(
        vertices=vertices,
        faces=np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3),
        normals=np.zeros((0, 3), np.float32),
        shapes=tuple(shapes),
        materials=np.full((1, 2, 3), 0.6, np.float32),
        emitters=(emitter,),
        camera=camera,
        film=Film(resolution, resolution, 0, 0, resolution, resolution, "box", 0.5),
        lighting=Lighting("mlrt", bsdf_samples=0),
        spp=1,
        base_seed=0,
        features=(),
        warnings=(),
        shape_names=tuple(f"shape {i}" for i in range(len(shapes))),
        not_finite_faces=(0,) * len(shapes),
    )


def triple(vector: npt.NDArray[np.floating]) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
