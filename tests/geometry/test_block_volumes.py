"""What single precision tells of a ray, alone or among those of one origin, and eight
triangles, against fractions."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
from tracing import each_core

SEED = 20261130

Vector = list[Fraction]


def exactly(v: npt.NDArray[np.float32]) -> Vector:
    return [Fraction(float(x)) for x in v]


def cross(p: Vector, q: Vector) -> Vector:
    return [
        p[1] * q[2] - p[2] * q[1],
        p[2] * q[0] - p[0] * q[2],
        p[0] * q[1] - p[1] * q[0],
    ]


def dot(p: Vector, q: Vector) -> Fraction:
    return sum((x * y for x, y in zip(p, q, strict=True)), Fraction(0))


def exact_hit(
    origin: npt.NDArray[np.float32],
    direction: npt.NDArray[np.float32],
    triangle: npt.NDArray[np.float32],
) -> tuple[bool, Fraction | None]:
    """Whether the ray's line meets the triangle, and the parameter where it meets its
    plane, if it does."""
    o, d = exactly(origin), exactly(direction)
    a, b, c = ([x - y for x, y in zip(exactly(v), o, strict=True)] for v in triangle)
    volumes = [dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))]
    hit = any(volumes) and (min(volumes) >= 0 or max(volumes) <= 0)
    along = sum(volumes)
    return hit, dot(a, cross(b, c)) / along if along else None


@each_core
@pytest.mark.parametrize("scale", [1e-30, 1e-15, 1e-6, 1.0, 1e6, 1e11, 1e20])
@pytest.mark.parametrize("distance", [1.0, 300.0])
@pytest.mark.parametrize("seen", ["seen_alone", "seen_in_packet"])
def test_what_is_told_is_true(
    core: ModuleType, seen: str, scale: float, distance: float
) -> None:
    """Rays through points, edges and surroundings of small triangles that are far away,
    where rounding counts most, and of thin ones."""
    rng = np.random.default_rng(SEED)
    certain = missed = bounded = 0
    for _ in range(120):
        origin = rng.normal(size=3).astype(np.float32)
        center = origin + distance * rng.normal(size=3)
        corners = rng.normal(size=(8, 3, 3))
        corners[::3, 2] = corners[::3, 1] + rng.choice([1e-3, 1e-6], (3, 1))
        triangles = (center + corners).astype(np.float32)
        weights = rng.choice([0, 0, 0.25, 0.5, 1, 1e-7, -1e-7], 3)
        weights /= weights.sum() if abs(weights.sum()) > 0.1 else 1
        target = weights @ triangles[0] if rng.random() < 0.8 else center
        direction = (target - origin).astype(np.float32)
        if rng.random() < 0.2:
            direction[rng.integers(3)] = 0
        if rng.random() < 0.1:
            direction = -direction
        if not direction.any():
            continue
        origin, triangles = np.float32(scale * origin), np.float32(scale * triangles)
        possible, sure, nearest, farthest, axis = getattr(core.wide_selftest, seen)(
            tuple(map(float, origin)), tuple(map(float, direction)), triangles
        )
        for i, triangle in enumerate(triangles):
            hit, t = exact_hit(origin, direction, triangle)
            if not possible >> i & 1:
                missed += 1
                assert not hit, (SEED, origin, direction, triangle)
                continue
            if sure >> i & 1:
                certain += 1
                assert hit, (SEED, origin, direction, triangle)
            if hit:
                bounded += 1
                assert t is not None
                depth = t * abs(Fraction(float(direction[axis])))
                # By more than what rounding the distance takes.
                margin = abs(depth) / 2**23
                if depth < 0:  # only the sign is told
                    assert nearest[i] < 0, (SEED, i, depth)
                    continue
                assert Fraction(nearest[i]) < depth - margin, (SEED, i, depth)
                assert Fraction(farthest[i]) > depth + margin, (SEED, i, depth)
    if scale > 1e-20 and scale * distance < 1e12:  # else too small or too large to tell
        assert min(certain, missed) > 30, (certain, missed)
    if scale > 1e-10 and scale * distance < 1e12:
        assert bounded > 30, bounded
