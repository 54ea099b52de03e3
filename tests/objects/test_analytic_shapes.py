"""Rays against spheres, disks and cylinders: against exact arithmetic."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from object_sets import closest, object_set

from mlrt_plugin._dispatch import core

Array = npt.NDArray[Any]
Exact = list[Fraction]
TYPES = {"sphere": 0, "disk": 1, "cylinder": 2}
MARGIN = Fraction(1, 2**44)
"""Of the size of what cancels in a discriminant: double precision leaves less in doubt."""


def exact(vector: Any) -> Exact:
    return [Fraction(float(x)) for x in vector]


def dot(a: Exact, b: Exact) -> Fraction:
    return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))


def inverse_of(frame: Array) -> tuple[list[Exact], Exact]:
    """Rows of the inverse of the linear part, and the origin, in fractions."""
    m = [exact(row[:3]) for row in frame]
    columns = [[m[i][j] for i in range(3)] for j in range(3)]

    def cross(a: Exact, b: Exact) -> Exact:
        return [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]

    x, y, z = columns
    volume = dot(x, cross(y, z))
    rows = [[c / volume for c in row] for row in (cross(y, z), cross(z, x), cross(x, y))]
    return rows, [Fraction(float(row[3])) for row in frame]


def root(value: Fraction) -> Fraction:
    """The square root to some 80 digits."""
    scale = 10**160
    return Fraction(math.isqrt(value.numerator * scale // value.denominator), 10**80)


def exact_hit(
    kind: str, frame: Array, origin: Array, direction: Array
) -> tuple[Fraction | None, bool]:
    """The least positive distance, or None, and whether it is beyond doubt."""
    o, d = exact(origin), exact(direction)
    if kind == "sphere":
        f = [a - Fraction(float(c)) for a, c in zip(o, frame[:, 3], strict=True)]
        # The core's radius is the length of the first axis in double precision.
        radius_2 = Fraction(float(np.linalg.norm(frame[:, 0]))) ** 2
        a, b, c = dot(d, d), -dot(f, d), dot(f, f) - radius_2
        size = dot(f, f) + radius_2
    else:
        rows, place = inverse_of(frame)
        f = [x - c for x, c in zip(o, place, strict=True)]
        lo, ld = [dot(row, f) for row in rows], [dot(row, d) for row in rows]
        if kind == "disk":
            if ld[2] == 0:
                return None, True
            t = -lo[2] / ld[2]
            x, y = lo[0] + t * ld[0], lo[1] + t * ld[1]
            rest = 1 - x * x - y * y
            sure = abs(rest) > MARGIN * (1 + dot(lo, lo) * dot(ld, ld) / ld[2] ** 2)
            return (t if rest >= 0 and t > 0 else None), sure
        a = ld[0] ** 2 + ld[1] ** 2
        b = -(lo[0] * ld[0] + lo[1] * ld[1])
        c = lo[0] ** 2 + lo[1] ** 2 - 1
        size = dot(lo, lo) + 1
    rest = b * b / a - c
    sure = abs(rest) > MARGIN * size
    if rest < 0:
        return None, sure
    half = root(rest * a)
    found = []
    for t in ((b - half) / a, (b + half) / a):
        sure &= abs(t) * root(a) > MARGIN * root(size) * 2**10
        if kind == "cylinder":
            z = lo[2] + t * ld[2]
            sure &= min(abs(z), abs(z - 1)) > MARGIN * size * 2**10
            if not 0 <= z <= 1:
                continue
        if t > 0:
            found.append(t)
    return (min(found) if found else None), sure


def random_frame(rng: np.random.Generator, kind: str, scale: float) -> Array:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    sizes = rng.uniform(0.3, 2, 3) if kind != "sphere" else np.ones(3) * rng.uniform(0.3, 2)
    frame = np.concatenate([turn * sizes, rng.normal(size=(3, 1))], axis=1) * scale
    return frame.astype(np.float32).astype(np.float64)


def aimed_rays(
    rng: np.random.Generator, frame: Array, count: int, scale: float
) -> tuple[Array, Array]:
    """Rays from inside, near and far, many of them at the silhouette."""
    distance = rng.choice([0.3, 3.0, 1e3], count)[:, None] * scale
    origins = rng.normal(size=(count, 3)) * distance + frame[:, 3]
    local = rng.normal(size=(count, 3))
    local /= np.linalg.norm(local, axis=1, keepdims=True)
    local *= rng.choice([0.5, 1.0, 1.2], count)[:, None]
    goals = local @ frame[:, :3].T + frame[:, 3]
    directions = (goals - origins) * 10 ** rng.uniform(-3, 3, (count, 1))
    return origins.astype(np.float32), directions.astype(np.float32)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("kind", TYPES)
def test_hits_are_those_of_exact_arithmetic(kind: str, scale: float) -> None:
    seed = 11
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    decided = met = 0
    for _ in range(4):
        frame = random_frame(rng, kind, scale)
        origins, directions = aimed_rays(rng, frame, 100, scale)
        t, _, _ = closest(object_set([TYPES[kind]], [frame]), origins, directions)
        for found, o, d in zip(t, origins, directions, strict=True):
            expected, sure = exact_hit(kind, frame, o, d)
            if not sure:
                continue
            decided += 1
            assert math.isfinite(found) == (expected is not None)
            if expected is not None:
                met += 1
                # One unit in the last place, and what is left of the cancellation of the
                # discriminant near a silhouette: half the digits of double precision.
                reach = float(np.linalg.norm(o - frame[:, 3])) / float(np.linalg.norm(d))
                tolerance = np.spacing(found) + 2.0**-24 * reach * 1e-2
                assert abs(float(found) - float(expected)) <= tolerance
    assert decided > 350 and met > 100


def test_grazing_rays_beside_a_sphere() -> None:
    """Lines at a distance of 1 -+ 10^-6 from the centre of a unit sphere, from afar."""
    objects = object_set([0], [np.eye(3, 4)])
    angles = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    for distance, hits in ((1 - 1e-6, True), (1 + 1e-6, False)):
        y, z = distance * np.cos(angles), distance * np.sin(angles)
        origins = np.stack([np.full_like(y, -1e4), y, z], axis=1).astype(np.float32)
        directions = np.tile(np.array([[1, 0, 0]], np.float32), (len(y), 1))
        t, _, _ = closest(objects, origins, directions)
        assert np.all(np.isfinite(t) == hits)


def test_origin_inside_meets_the_far_side() -> None:
    objects = object_set([0], [np.eye(3, 4) * 2])
    t, _, _ = closest(
        objects, np.zeros((1, 3), np.float32), np.eye(3, dtype=np.float32)[:1]
    )
    assert t.tolist() == [2]
    # Nothing lies in an interval that ends before.
    t, face, _ = closest(
        objects, np.zeros((1, 3), np.float32), np.eye(3, dtype=np.float32)[:1], 1.99
    )
    assert t.tolist() == [math.inf] and face.tolist() == [-1]


def test_rays_in_the_plane_of_a_disk_and_along_a_cylinder_miss() -> None:
    origins = np.array([[-3, 0, 0], [0, 0, -3], [0.5, 0, -3]], np.float32)
    directions = np.array([[1, 0, 0], [0, 0, 1], [0, 0, 1]], np.float32)
    for kind, expected in ((1, [math.inf, 3, 3]), (2, [2, math.inf, math.inf])):
        t, _, _ = closest(object_set([kind], [np.eye(3, 4)]), origins, directions)
        assert t.tolist() == expected


def test_rays_that_are_no_rays_miss() -> None:
    origins = np.array([[-3, 0, 0], [math.nan, 0, 0], [-3, 0, 0]], np.float32)
    directions = np.array([[0, 0, 0], [1, 0, 0], [math.inf, 0, 0]], np.float32)
    t, _, _ = closest(object_set([0], [np.eye(3, 4)]), origins, directions)
    assert not np.isfinite(t).any()


def test_first_of_equal_objects_is_hit_and_triangles_before_all() -> None:
    frames = [np.eye(3, 4)] * 3
    origins, directions = np.array([[0, 0, 5.0]] * 40), np.array([[0, 0, -1.0]] * 40)
    rays = origins.astype(np.float32), directions.astype(np.float32)
    _, face, _ = closest(object_set([1, 1, 1], frames), *rays)
    assert set(face.tolist()) == {0}
    square = np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32)
    tree = core.KdTree(square, np.array([[0, 1, 2]], np.uint32))
    objects = object_set([1, 1, 1], frames, first_face=1)
    ends = np.zeros(40, np.float32), np.full(40, np.inf, np.float32)
    t, face, instance, _, _ = objects.closest_hit(tree, *rays, *ends, {})
    assert set(face.tolist()) == {0} and set(instance.tolist()) == {-1}
    assert set(t.tolist()) == {5}


@pytest.mark.parametrize("frame", [np.zeros((3, 4)), np.full((3, 4), np.nan)])
def test_frames_that_flatten_are_refused(frame: Array) -> None:
    with pytest.raises(ValueError, match=r"analytic_frames\[0\] must be finite and not"):
        object_set([0], [frame])
