"""What single precision decides about a ray and eight triangles, against fractions."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import numpy.typing as npt
import oracles
import pytest
from tracing import each_core

SEED = 20261129


def signs(
    origin: npt.NDArray[np.float32],
    direction: npt.NDArray[np.float32],
    triangle: npt.NDArray[np.float32],
) -> tuple[int, int]:
    """How many of the three volumes are positive, and how many negative, exactly."""
    o, d, *corners = (oracles.to_point(v) for v in (origin, direction, *triangle))
    a, b, c = ([x - y for x, y in zip(corner, o, strict=True)] for corner in corners)

    def volume(p: list[int], q: list[int]) -> int:
        return (
            d[0] * (p[1] * q[2] - p[2] * q[1])
            + d[1] * (p[2] * q[0] - p[0] * q[2])
            + d[2] * (p[0] * q[1] - p[1] * q[0])
        )

    values = [volume(b, c), volume(c, a), volume(a, b)]
    return sum(v > 0 for v in values), sum(v < 0 for v in values)


@each_core
@pytest.mark.parametrize("scale", [1e-25, 1e-15, 1e-6, 1.0, 1e6, 1e15, 1e17, 1e25])
@pytest.mark.parametrize("distance", [1.0, 300.0])
def test_what_is_certain_is_true(core: ModuleType, scale: float, distance: float) -> None:
    """Rays through points, edges and surroundings of small triangles that are far away,
    where rounding counts most."""
    rng = np.random.default_rng(SEED)
    certain = [0, 0]
    for _ in range(150):
        origin = rng.normal(size=3).astype(np.float32)
        center = origin + distance * rng.normal(size=3)
        triangles = (center + rng.normal(size=(8, 3, 3))).astype(np.float32)
        weights = rng.choice([0, 0, 0.25, 0.5, 1, 1e-7, -1e-7], 3)
        weights /= weights.sum() if abs(weights.sum()) > 0.1 else 1
        target = weights @ triangles[0] if rng.random() < 0.8 else center
        direction = (target - origin).astype(np.float32)
        if rng.random() < 0.2:
            direction[rng.integers(3)] = 0
        if not direction.any():
            continue
        origin, triangles = np.float32(scale * origin), np.float32(scale * triangles)
        hits, misses = core.wide_selftest.decided(
            tuple(map(float, origin)), tuple(map(float, direction)), triangles
        )
        assert not hits & misses
        for i, triangle in enumerate(triangles):
            positive, negative = signs(origin, direction, triangle)
            if hits >> i & 1:
                assert 3 in (positive, negative), (SEED, origin, direction, triangle)
            if misses >> i & 1:
                assert positive and negative, (SEED, origin, direction, triangle)
            certain[0] += hits >> i & 1
            certain[1] += misses >> i & 1
    if 1e-20 < scale < 1e16:  # else too small or too large to tell
        assert min(certain) > 40, certain
