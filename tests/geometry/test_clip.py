"""Clipping of triangles to cells, against the same in fractions."""

from __future__ import annotations

from fractions import Fraction

import exact_geometry as exact
import numpy as np
import numpy.typing as npt
import pytest

from mlrt_plugin._dispatch import core

selftest = core.kdtree_selftest
SEED = 20260102
FloatArray = npt.NDArray[np.float32]


def clip(triangle: FloatArray, lo: FloatArray, hi: FloatArray) -> list[FloatArray] | None:
    """Returns the bounds that the core finds, or None if it finds no intersection."""
    part = selftest.clip_triangle(triangle.tolist(), lo.tolist(), hi.tolist())
    return None if part is None else [np.array(p, np.float32) for p in part]


def exact_part(triangle: FloatArray, lo: FloatArray, hi: FloatArray) -> exact.Polygon:
    return exact.clip(exact.polygon(triangle), exact.point(lo), exact.point(hi))


def assert_encloses(
    triangle: FloatArray, lo: FloatArray, hi: FloatArray, ulps: float | None = 1.0
) -> bool:
    """Asserts that clipping loses nothing and, if ``ulps`` is given, that its bounds exceed
    the exact ones by no more than so many float32 steps.

    Returns whether anything is left.
    """
    message = f"seed {SEED}: {triangle.tolist()} in {lo.tolist()} .. {hi.tolist()}"
    part = exact_part(triangle, lo, hi)
    found = clip(triangle, lo, hi)
    if not part:
        assert ulps is None or found is None, message
        return False
    assert found is not None, message
    for k, (low, high) in enumerate(zip(*exact.bounds(part), strict=True)):
        assert lo[k] <= found[0][k] <= found[1][k] <= hi[k], message
        below = low - Fraction(float(found[0][k]))
        above = Fraction(float(found[1][k])) - high
        assert below >= 0, message
        assert above >= 0, message
        if ulps is not None:
            # Where coordinates cancel, precision is relative to those that cancelled.
            step = max(2.0**-149, float(np.abs(triangle[:, k]).max()) * 2.0**-44)
            assert below <= ulps * max(step, np.spacing(abs(found[0][k]))), message
            assert above <= ulps * max(step, np.spacing(abs(found[1][k]))), message
    return True


def random_cells(rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    corners = np.sort(rng.uniform(-1, 1, (count, 2, 3)).astype(np.float32), axis=1)
    return corners[:, 0], corners[:, 1]


def test_bounds_of_random_triangles_are_tight() -> None:
    rng = np.random.default_rng(SEED)
    lo, hi = random_cells(rng, 1500)
    triangles = rng.uniform(-1.5, 1.5, (1500, 3, 3)).astype(np.float32)
    found = [assert_encloses(*case) for case in zip(triangles, lo, hi, strict=True)]
    assert 100 < sum(found) < 1400


@pytest.mark.parametrize(
    ("scale", "offset"), [(1.0, 0.0), (1.0, 1e6), (2.0**-130, 0.0), (2.0**100, 0.0)]
)
def test_contact_counts(scale: float, offset: float) -> None:
    """Small integers: corners, edges and faces of cells are met exactly, all the time."""
    rng = np.random.default_rng(SEED)
    contacts = 0
    for _ in range(1200):
        corners = np.sort(rng.integers(-3, 4, (2, 3)), axis=0)
        triangle = rng.integers(-4, 5, (3, 3))
        if not np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0]).any():
            continue
        lo, hi = ((corners + offset) * scale).astype(np.float32)
        moved = ((triangle + offset) * scale).astype(np.float32)
        if assert_encloses(moved, lo, hi):
            least, greatest = exact.bounds(exact_part(moved, lo, hi))
            contacts += least == greatest and not (moved == exact_float(least)).all(1).any()
    assert contacts > 10, "too few triangles touch a cell in one point that is not a vertex"


def exact_float(p: exact.Point) -> FloatArray:
    return np.array([float(x) for x in p], np.float32)


@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_a_point_of_contact_is_kept(offset: float) -> None:
    """A cell that touches a triangle, anywhere on it, with one corner."""
    rng = np.random.default_rng(SEED)
    for _ in range(400):
        corner = (rng.integers(-8, 9, 3) + offset).astype(np.float64)
        normal = rng.integers(1, 6, 3) * rng.choice([-1, 1], 3)
        # Two directions in a plane through the corner, which is inside, on an edge or at a
        # vertex of the triangle. The cell lies on the other side of the plane.
        u = np.array([normal[1], -normal[0], 0.0])
        v = np.array([0.0, normal[2], -normal[1]])
        kind = rng.integers(3)
        around = [(u, v, -u - v), (u, -u, v), (0 * u, u, v)][kind]
        triangle = (corner + np.array(around)).astype(np.float32)
        away = corner + np.sign(normal)
        lo, hi = np.sort([corner, away], axis=0).astype(np.float32)
        found = clip(triangle, lo, hi)
        message = f"seed {SEED}: {triangle.tolist()} in {lo.tolist()} .. {hi.tolist()}"
        assert found is not None, message
        assert (found[0] <= corner).all(), message
        assert (found[1] >= corner).all(), message


def test_triangles_in_a_face_stay_flat() -> None:
    rng = np.random.default_rng(SEED)
    lo, hi = random_cells(rng, 300)
    for i in range(300):
        axis = i % 3
        triangle = rng.uniform(-1.5, 1.5, (3, 3)).astype(np.float32)
        triangle[:, axis] = (lo, hi)[i % 2][i, axis]
        if assert_encloses(triangle, lo[i], hi[i]):
            found = clip(triangle, lo[i], hi[i])
            assert found is not None
            assert found[0][axis] == found[1][axis] == triangle[0, axis]
        # A cell of no extent that holds the triangle's plane.
        flat_lo, flat_hi = lo[i].copy(), hi[i].copy()
        flat_lo[axis] = flat_hi[axis] = triangle[0, axis]
        assert_encloses(triangle, flat_lo, flat_hi)


def test_slivers_are_not_lost() -> None:
    """Vertices a few rounding steps off a line: positions along it are ill-conditioned, so
    only enclosure is asked for."""
    rng = np.random.default_rng(SEED)
    kept = 0
    for _ in range(600):
        a, b = rng.uniform(-1, 1, (2, 3))
        c = a + rng.uniform() * (b - a)
        triangle = np.array([a, b, c], np.float32)
        triangle = np.nextafter(triangle, rng.choice([-9, 9], (3, 3)).astype(np.float32))
        centre = np.float32(triangle[2] + rng.normal(0, 1e-7, 3))
        size = np.float32(10.0 ** rng.uniform(-8, 0, 3))
        kept += assert_encloses(triangle, centre - size, centre + size, ulps=None)
    assert kept > 50


@pytest.mark.parametrize("scale", [1e-44, 1e-30, 1e30, 3e38])
def test_extreme_extents(scale: float) -> None:
    rng = np.random.default_rng(SEED)
    for _ in range(150):
        triangle = (rng.uniform(-1, 1, (3, 3)) * scale).astype(np.float32)
        lo, hi = np.sort((rng.uniform(-1, 1, (2, 3)) * scale).astype(np.float32), axis=0)
        assert_encloses(triangle, lo, hi)


def test_mixed_magnitudes_are_not_lost() -> None:
    """Coordinates from the least denormal number up, in one triangle and cell."""
    rng = np.random.default_rng(SEED)

    def spread(shape: tuple[int, ...]) -> FloatArray:
        exponents = rng.integers(-149, 127, shape)
        sign = rng.choice([-1.0, 0.0, 1.0], shape)
        return np.asarray(np.ldexp(sign * rng.uniform(1, 2, shape), exponents), np.float32)

    for _ in range(600):
        lo, hi = np.sort(spread((2, 3)), axis=0)
        assert_encloses(spread((3, 3)), lo, hi, ulps=None)


def test_cells_of_a_grid_together_hold_a_triangle() -> None:
    """Every cell that the exact triangle touches keeps it, however it meets corners."""
    rng = np.random.default_rng(SEED)
    planes = [np.sort(rng.uniform(-1, 1, 4)).astype(np.float32) for _ in range(3)]
    for _ in range(15):
        # Vertices on crossings of planes, so that edges and faces run through cell corners.
        triangle = np.array(
            [[rng.choice(planes[k]) for k in range(3)] for _ in range(3)], np.float32
        )
        for i in np.ndindex(3, 3, 3):
            lo = np.array([planes[k][i[k]] for k in range(3)])
            hi = np.array([planes[k][i[k] + 1] for k in range(3)])
            assert_encloses(triangle, lo, hi, ulps=None)
