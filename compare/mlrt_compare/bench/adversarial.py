"""Small scenes and rays that rounding makes tracers fail on.

Where coordinates lie on a grid, rays meet vertices and edges exactly, not just nearly.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .closed_meshes import FAR, sphere

FloatArray = npt.NDArray[np.float32]
Rays = tuple[FloatArray, FloatArray]
GRID = 2.0**-10
SCALE = 96
"""Power of two that lengthens or shortens directions which are out of scale; those of other
rays differ from 1 by less than half as much."""


@dataclass(frozen=True)
class SmallScene:
    """vertices (V, 3) float32, faces (F, 3) uint32."""

    name: str
    vertices: FloatArray
    faces: npt.NDArray[np.uint32]

    def bounds(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        wide = self.vertices.astype(np.float64)
        return wide.min(axis=0), wide.max(axis=0)


def snap(values: npt.NDArray[np.floating]) -> FloatArray:
    rounded: FloatArray = (np.round(values.astype(np.float64) / GRID) * GRID).astype(
        np.float32
    )
    return rounded


def separate(name: str, corners: npt.NDArray[np.floating]) -> SmallScene:
    """Triangles (F, 3, 3) that share no vertices."""
    vertices = corners.astype(np.float32).reshape(-1, 3)
    return SmallScene(
        name, vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    )


def soup(rng: np.random.Generator) -> SmallScene:
    corners = rng.uniform(-1, 1, (300, 1, 3)) + rng.uniform(-0.3, 0.3, (300, 3, 3))
    return separate("soup", snap(corners))


def slivers(rng: np.random.Generator) -> SmallScene:
    """Needles and caps: two corners, or all three of them, nearly on one line."""
    start, along = rng.uniform(-1, 1, (2, 200, 3))
    width = 10.0 ** rng.uniform(-7, -2, (200, 1)) * rng.uniform(-1, 1, (200, 3))
    middle = np.where(np.arange(200)[:, None] % 2, 0.0, 0.5)
    third = start + middle * along + width
    return separate("slivers", np.stack([start, start + along, third], axis=1))


def coincident(rng: np.random.Generator) -> SmallScene:
    """Triangles in few planes that overlap, of which half are there twice."""
    corners = snap(rng.uniform(-1, 1, (100, 1, 3)) + rng.uniform(-0.7, 0.7, (100, 3, 3)))
    corners[:60, :, 2] = rng.choice([-0.5, 0.0, 0.5], 60)[:, None]
    return separate("coincident", rng.permutation(np.concatenate([corners, corners[::2]])))


def stairs(rng: np.random.Generator) -> SmallScene:
    """Boxes that share faces."""
    cube = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4),
             (1, 5, 7, 3)]  # fmt: skip
    faces = np.array([face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))])
    steps = np.arange(12)
    boxes = [(cube * (1, 1, 1 + i) + (i, 0, 0)) / 6 - 1 for i in steps]
    numbers = np.concatenate([faces + 8 * i for i in steps])
    return SmallScene(
        "stairs", snap(np.concatenate(boxes)), np.ascontiguousarray(numbers, np.uint32)
    )


def ball(rng: np.random.Generator) -> SmallScene:
    mesh = sphere(3)
    return SmallScene("sphere", mesh.vertices, mesh.faces)


def far_ball(rng: np.random.Generator) -> SmallScene:
    mesh = sphere(3)
    vertices = 8 * mesh.vertices.astype(np.float64) + FAR
    return SmallScene("sphere at 10^6", vertices.astype(np.float32), mesh.faces)


SCENES: tuple[Callable[[np.random.Generator], SmallScene], ...] = (
    soup,
    ball,
    far_ball,
    slivers,
    coincident,
    stairs,
)


def outside(rng: np.random.Generator, scene: SmallScene, count: int) -> FloatArray:
    """Points about as far from the scene as it is wide, on the grid."""
    lo, hi = scene.bounds()
    way = rng.normal(size=(count, 3))
    way *= 1.5 * float((hi - lo).max()) / np.linalg.norm(way, axis=1, keepdims=True)
    return snap((lo + hi) / 2 + way)


def towards(origins: FloatArray, targets: FloatArray) -> Rays:
    directions = targets - origins
    directions[~directions.any(axis=1)] = (1, 0, 0)
    return origins, directions


def inside(rng: np.random.Generator, scene: SmallScene, count: int) -> FloatArray:
    lo, hi = scene.bounds()
    points: FloatArray = (lo + rng.uniform(size=(count, 3)) * (hi - lo)).astype(np.float32)
    return points


def ends_of_edges(
    rng: np.random.Generator, scene: SmallScene, count: int
) -> tuple[FloatArray, FloatArray]:
    face = scene.faces[rng.integers(0, len(scene.faces), count)]
    corner, row = rng.integers(0, 3, count), np.arange(count)
    return scene.vertices[face[row, corner]], scene.vertices[face[row, (corner + 1) % 3]]


def at_vertices(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    return towards(outside(rng, scene, count), ends_of_edges(rng, scene, count)[0])


def at_edges(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    """At middles of edges, and at other points of them."""
    a, b = (ends.astype(np.float64) for ends in ends_of_edges(rng, scene, count))
    share = np.where(rng.random((count, 1)) < 0.5, 0.5, rng.uniform(size=(count, 1)))
    return towards(outside(rng, scene, count), (a + share * (b - a)).astype(np.float32))


def along_axes(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    """With one, two or no components of either zero, through vertices and other points."""
    signs = np.array(list(itertools.product((-1.0, -0.0, 0.0, 1.0), repeat=3)), np.float32)
    directions = rng.choice(signs[signs.any(axis=1)], count)
    vertices, _ = ends_of_edges(rng, scene, count)
    targets = np.where(rng.random((count, 1)) < 0.5, vertices, inside(rng, scene, count))
    reach = np.float32(2 * float(np.ptp(scene.vertices, axis=0).max()))
    return (targets - reach * directions).astype(np.float32), directions


def from_planes(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    """From points with single coordinates of vertices, where trees are split, and within
    planes."""
    # Of a vertex for each axis: all of one would put the origin on a face.
    rows = rng.integers(0, len(scene.vertices), (count, 3))
    planes = scene.vertices[rows, [0, 1, 2]]
    origins = np.where(rng.random((count, 3)) < 0.5, planes, inside(rng, scene, count))
    directions = snap(rng.uniform(-1, 1, (count, 3)))
    directions[rng.random((count, 3)) < 0.2] = 0
    directions[~directions.any(axis=1)] = (0, 0, -1)
    return origins, directions


def grazing(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    """Almost in the plane of a face, or exactly along one of its edges."""
    a, b = ends_of_edges(rng, scene, count)
    along = b.astype(np.float64) - a
    tilt = rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-8, -3, (count, 1))
    tilt[rng.random(count) < 0.3] = 0
    directions = (along + tilt).astype(np.float32)
    directions[~directions.any(axis=1)] = (0, 1, 0)
    return (a - np.float32(2) * directions).astype(np.float32), directions


def out_of_scale(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    """At vertices and edges, by directions so long or so short that single precision could
    lose planes."""
    half = count // 2
    parts = at_vertices(rng, scene, half), at_edges(rng, scene, count - half)
    origins, directions = (np.concatenate(both) for both in zip(*parts, strict=True))
    return origins, np.ldexp(directions, rng.choice([-SCALE, SCALE], (count, 1)))


def anywhere(rng: np.random.Generator, scene: SmallScene, count: int) -> Rays:
    """As a control: at random points of the scene's box."""
    return towards(outside(rng, scene, count), inside(rng, scene, count))


RAYS: tuple[Callable[[np.random.Generator, SmallScene, int], Rays], ...] = (
    at_vertices,
    at_edges,
    along_axes,
    from_planes,
    grazing,
    out_of_scale,
    anywhere,
)


def shared_origin(rays: Rays, every: int) -> Rays:
    """The same with one origin for each `every` rays in a row, aimed as they were."""
    origins, directions = rays
    first = np.arange(len(origins)) // every * every
    length = np.frexp(np.abs(directions).max(axis=1, keepdims=True))[1]
    power = SCALE * np.round(length / SCALE).astype(int)
    origin, to_target = towards(origins[first], origins + np.ldexp(directions, -power))
    return origin, np.ldexp(to_target, power)
