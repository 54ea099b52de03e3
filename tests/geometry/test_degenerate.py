"""Which triangles count as having no area, against exact cross products."""

from __future__ import annotations

from fractions import Fraction

import exact_geometry as exact
import numpy as np
import numpy.typing as npt
import pytest

from mlrt_plugin._dispatch import core

selftest = core.kdtree_selftest
SEED = 20260103


def has_zero_area(triangle: npt.NDArray[np.float32]) -> bool:
    a, b, c = exact.polygon(triangle)
    u = [q - p for p, q in zip(a, b, strict=True)]
    v = [q - p for p, q in zip(a, c, strict=True)]
    cross = [u[i] * v[j] - u[j] * v[i] for i, j in ((0, 1), (1, 2), (2, 0))]
    return cross == [Fraction(0)] * 3


@pytest.mark.parametrize("scale", [1.0, 1e-38, 2.0**-149, 1e30])
def test_agrees_with_exact_arithmetic(scale: float) -> None:
    rng = np.random.default_rng(SEED)
    answers = []
    for i in range(900):
        direction = rng.integers(-9, 10, 3)
        start = rng.integers(-99, 100, 3)
        triangle = start + rng.integers(-9, 10, (3, 1)) * direction
        if i % 3 == 1:
            triangle[2, i % 2] += 1
        corners = np.asarray(triangle * scale, np.float32)
        if i % 3 == 2:
            corners = np.nextafter(corners, np.float32(rng.choice([-np.inf, np.inf])))
            corners = np.where(np.isfinite(corners), corners, np.float32(0))
        expected = has_zero_area(corners)
        assert selftest.is_degenerate(corners.tolist()) == expected, (
            SEED,
            corners.tolist(),
        )
        answers.append(expected)
    assert 100 < sum(answers) < 800


def test_slivers_have_area_and_lines_have_none() -> None:
    one = np.float32(1)
    beyond = float(np.nextafter(one, np.float32(2)))
    assert not selftest.is_degenerate([(0, 0, 0), (1, 1, 0), (1, beyond, 0)])
    assert not selftest.is_degenerate([(0, 0, 0), (1, 0, 0), (1, 2.0**-149, 0)])
    assert not selftest.is_degenerate([(0, 0, 0), (3e38, 0, 0), (-3e38, 2.0**-149, 0)])
    assert selftest.is_degenerate([(0, 0, 0), (1, 1, 1), (3, 3, 3)])
    assert selftest.is_degenerate([(5, 5, 5)] * 3)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_dropped(value: float) -> None:
    for i in range(9):
        corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
        corners.flat[i] = value
        assert selftest.is_degenerate(corners.tolist())
