"""What triangles leave uncovered of a rectangle, against exact areas of unions."""

from __future__ import annotations

from fractions import Fraction

import exact_geometry as exact
import numpy as np
import numpy.typing as npt
import pytest

from mlrt_plugin._dispatch import core

selftest = core.kdtree_selftest
SEED = 20260104


def exactly_uncovered(lo: list[int], hi: list[int], triangles: npt.ArrayLike) -> Fraction:
    low, high = exact.point(lo), exact.point(hi)
    parts = [exact.clip(exact.polygon(t), low, high) for t in np.asarray(triangles)]
    return (high[0] - low[0]) * (high[1] - low[1]) - exact.union_area(parts)


@pytest.mark.parametrize("count", [1, 3, 10, 30])
def test_agrees_with_exact_areas(count: int) -> None:
    rng = np.random.default_rng(SEED + count)
    for _ in range(max(1, 60 // count)):
        triangles = rng.integers(-5, 12, (count, 3, 2))
        expected = exactly_uncovered([0, 0], [6, 8], triangles)
        found = selftest.uncovered_area([0, 0, 6, 8], triangles.tolist())
        assert found == pytest.approx(float(expected), abs=1e-9), (SEED, triangles.tolist())


def mesh(columns: int, rows: int) -> list[list[tuple[float, float]]]:
    """Returns two triangles for each field of a grid on the unit square."""
    triangles = []
    for i in range(columns):
        for j in range(rows):
            x, y, u, v = i / columns, j / rows, (i + 1) / columns, (j + 1) / rows
            triangles += [[(x, y), (u, y), (u, v)], [(x, y), (u, v), (x, v)]]
    return triangles


def test_tessellations_cover_and_holes_are_found() -> None:
    wall = mesh(23, 17)
    assert selftest.uncovered_area([0, 0, 1, 1], wall) < 1e-12
    hole = selftest.uncovered_area([0, 0, 1, 1], wall[:100] + wall[101:])
    assert hole == pytest.approx(0.5 / (23 * 17), rel=1e-6)


def test_duplicates_do_not_fake_cover() -> None:
    half = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)]
    assert selftest.uncovered_area([0, 0, 1, 1], [half] * 500) == pytest.approx(0.5)
    assert selftest.uncovered_area([0, 0, 1, 1], mesh(5, 5)[:-1] * 40) == pytest.approx(
        0.02
    )
