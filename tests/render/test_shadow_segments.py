"""The ends of robust shadow rays lie on the right sides of planes, by exact fractions."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from mlrt_plugin._dispatch import core

SEED = 20261128
FloatArray = npt.NDArray[np.float32]
Exact = tuple[Fraction, Fraction, Fraction]
CAMERA = {
    "origin": [0, 0, 1],
    "axes": np.eye(3),
    "tan_half_fov_x": 1,
    "near_clip": 0.1,
    "far_clip": 10,
}
ROUNDING = 2.0**-24


def exact(v: Any) -> Exact:
    x, y, z = (Fraction(float(c)) for c in v)
    return x, y, z


def difference(a: Exact, b: Exact) -> Exact:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def total(a: Exact, b: Exact) -> Exact:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def height(point: Exact, triangle: FloatArray) -> float:
    """Signed distance from the triangle's plane: the sign is exact."""
    a, b, c = (exact(v) for v in triangle)
    (x1, y1, z1), (x2, y2, z2) = difference(b, a), difference(c, a)
    normal = (y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2)
    product = sum((n * d for n, d in zip(normal, difference(point, a), strict=True)))
    # Squares of what is tiny would vanish in double precision.
    largest = max(abs(n) for n in normal)
    length = float(np.linalg.norm([float(n / largest) for n in normal]))
    return float(product / largest) / length


class Lamp:
    """A receiver, face 0, and a light."""

    def __init__(self, kind: str, receiver: FloatArray, panel: FloatArray) -> None:
        """panel: a corner and two edges."""
        corner, u, v = panel
        vertices = [*receiver]
        self.faces_of_light: list[int] = []
        emitter: dict[str, Any] = {"type": "point", "radiance": [1, 1, 1]}
        shapes = [{"first_face": 0, "face_count": 1, "material": 0}]
        if kind in ("rectangle", "mesh"):
            vertices += [corner, corner + u, corner + v]
            vertices += [corner + u, corner + u + v, corner + v]
            self.faces_of_light = [1, 2]
            shapes.append({"first_face": 1, "face_count": 2, "material": 0, "emitter": 0})
            emitter |= {"type": "area", "shape": 1}
            if kind == "rectangle":
                edges = {"edge_u": vertices[4] - corner, "edge_v": vertices[5] - corner}
                emitter |= {"rectangle": True, "corner": corner, **edges}
        else:
            emitter["position"] = corner if kind == "point" else corner * np.float32(1e4)
        self.vertices = np.array(vertices, np.float32)
        faces = np.arange(len(self.vertices), dtype=np.uint32).reshape(-1, 3)
        self.scene = core.Scene(
            core.KdTree(self.vertices, faces),
            faces[:0],
            np.zeros((0, 3), np.float32),
            shapes,
            np.ones((1, 2, 3), np.float32),
            [emitter],
            CAMERA,
            {"width": 1, "height": 1, "filter": "box"},
        )

    def triangle(self, face: int) -> FloatArray:
        return self.vertices[3 * face : 3 * face + 3]


def transformation(random: np.random.Generator) -> npt.NDArray[np.float64]:
    return np.linalg.qr(random.normal(size=(3, 3)))[0]


@pytest.mark.parametrize("kind", ["point", "far point", "rectangle", "mesh"])
@pytest.mark.parametrize("size", [1e-8, 1e-6, 1e-3, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("shift", [0.0, 30.0, 1e4])
def test_ends_are_beside_the_planes(kind: str, size: float, shift: float) -> None:
    """shift: of the origin, in sizes of the scene."""
    random = np.random.default_rng(SEED)
    trials, decided = 60, 0
    for trial in range(trials):
        turn = transformation(random)
        offset = shift * random.normal(size=3)

        def placed(points: Any, turn: Any = turn, offset: Any = offset) -> FloatArray:
            moved = (np.asarray(points) @ turn + offset) * size
            return moved.astype(np.float32)

        receiver = placed(random.uniform(-1, 1, (3, 3)) * (3, 3, 1))
        panel = placed(random.uniform([-1, -1, 1], [1, 1, 3], (3, 3)))
        panel[1:] -= panel[0]
        lamp = Lamp(kind, receiver, panel)
        weights = random.dirichlet([0.3, 0.3, 0.3]).astype(np.float32)
        aim = (weights[:, None] * receiver).sum(axis=0)
        origin = placed(random.uniform(-2, 2, 3))
        x, y = random.random(2).astype(np.float32)
        segment = core.render_selftest.robust_segment(
            lamp.scene, origin, aim - origin, 0, x, y
        )
        start = np.array(segment["start"], np.float32)
        target = np.array(segment["target"], np.float32)
        light = exact(segment["light"])
        what = f"seed {SEED}, trial {trial}, {segment}"
        assert segment["from_light"] == (kind == "point"), what

        # As ShadowTracer makes the ray, and where it is exactly at t = 1.
        if segment["from_light"]:
            begin, end = exact(target), total(exact(target), exact(start - target))
            near_receiver, near_light = end, begin
        else:
            begin, end = exact(start), total(exact(start), exact(target - start))
            near_receiver, near_light = begin, end

        coordinates = float(np.abs([*receiver, start]).max())
        length = float(np.abs(target.astype(np.float64) - start).max())
        noise = 30 * ROUNDING * (coordinates + length)
        above = height(light, receiver)
        if abs(above) > noise:
            decided += 1
            for point in (exact(start), near_receiver):
                assert height(point, receiver) * above > 0, what
            # Minimal: a few units in the last place of the point or of the ray's way.
            reach = length if segment["from_light"] else 0.0
            limit = 4 * ROUNDING * (float(np.abs(start).max()) + reach)
            assert abs(height(exact(start), receiver)) <= limit + 2.0**-148, what
        # A rectangle counts as flat; of a mesh the face that the sample lies on.
        faces = [segment["face"]] if kind == "mesh" else lamp.faces_of_light
        assert set(faces) <= set(lamp.faces_of_light), what
        for face in faces:
            triangle = lamp.triangle(face)
            front = height(exact(start), triangle)
            if abs(front) > noise:
                for point in (exact(target), near_light):
                    assert height(point, triangle) * front > 0, what
    # What is within rounding of a plane may be on either side of it.
    assert decided > (0.9 if shift < 1e4 else 0.8) * trials
