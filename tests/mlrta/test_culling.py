"""Culling never excludes what a member ray enters, but does exclude most of the rest."""

from __future__ import annotations

import itertools
from types import ModuleType
from typing import Any

import beams
import numpy as np
import oracles
import pytest
from tracing import each_core
from workloads import snap

SEED = 4711
Cell = tuple[tuple[float, ...], tuple[float, ...]]


def random_cell(rng: np.random.Generator, origins: Any, directions: Any) -> Cell:
    """Returns a cell on a coarse grid, often flat, near a ray or around its origin."""
    ray = rng.integers(len(origins))
    centre = origins[ray] + rng.uniform(-0.5, 3) * directions[ray]
    half = rng.choice([0, 0.125, 0.5, 1.5], 3)
    lo, hi = (np.round((centre + sign * half) * 8) / 8 for sign in (-1, 1))
    return tuple(map(float, lo)), tuple(map(float, hi))


def enters(origins: Any, directions: Any, t_max: float, cell: Cell) -> bool:
    """Whether any of the rays meets the closed cell."""
    return any(
        oracles.segment_meets_box(o, d, t_max, *cell)
        for o, d in zip(origins, directions, strict=True)
    )


def made_beam(
    core: ModuleType, rng: np.random.Generator, common_origin: bool
) -> tuple[Any, Any, Any, float]:
    origins, directions = beams.bundle(rng, 8, common_origin)
    t_max = float(rng.choice([np.inf, 1.0, 2.5]))
    ends = np.zeros(8, np.float32), np.full(8, t_max, np.float32)
    beam = core.mlrta_selftest.ray_beam(origins, directions, *ends, common_origin)
    return beam, origins, directions, t_max


@each_core
@pytest.mark.parametrize("common_origin", [True, False])
def test_children_that_rays_enter_are_kept(core: ModuleType, common_origin: bool) -> None:
    rng = np.random.default_rng(SEED)
    culled = empty = 0
    for _ in range(150):
        beam, origins, directions, t_max = made_beam(core, rng, common_origin)
        for _ in range(8):
            lo, hi = random_cell(rng, origins, directions)
            axis = int(rng.integers(3))
            share = float(rng.choice([0, 0.25, 0.5, 1]))
            position = float(np.float32(lo[axis] + share * (hi[axis] - lo[axis])))
            middle_lo, middle_hi = list(lo), list(hi)
            middle_lo[axis] = middle_hi[axis] = position
            children = (lo, tuple(middle_hi)), (tuple(middle_lo), hi)
            answer = core.mlrta_selftest.cull_children(beam, lo, hi, axis, position)
            upper_is_near = core.mlrta_selftest.upper_is_near(beam, axis, position)
            near, far = children[upper_is_near], children[not upper_is_near]
            near_entered = enters(origins, directions, t_max, near)
            far_entered = enters(origins, directions, t_max, far)
            case = (SEED, origins, directions, t_max, (lo, hi), axis, position)
            assert answer in ("near_only", "far_only", "both", "neither")
            assert answer in ("far_only", "both") or not far_entered, case
            assert answer in ("near_only", "both") or not near_entered, case
            culled += answer != "both"
            empty += near_entered != far_entered
    # Where rays enter one child only, most answers say so.
    assert culled > 0.4 * empty > 100


LEAF_TESTS = ["may_enter_by_parameters", "may_enter_by_slopes", "may_enter_by_planes"]


@each_core
@pytest.mark.parametrize("test", LEAF_TESTS)
@pytest.mark.parametrize("common_origin", [True, False])
def test_leaves_that_rays_enter_are_kept(
    core: ModuleType, test: str, common_origin: bool
) -> None:
    rng = np.random.default_rng(SEED)
    may_enter = getattr(core.mlrta_selftest, test)
    rejected = free = 0
    for _ in range(200):
        beam, origins, directions, t_max = made_beam(core, rng, common_origin)
        for _ in range(6):
            cell = random_cell(rng, origins, directions)
            entered = enters(origins, directions, t_max, cell)
            answer = may_enter(beam, *cell)
            assert answer or not entered, (SEED, origins, directions, t_max, cell)
            rejected += not answer
            free += not entered
    if test == "may_enter_by_planes" and not common_origin:
        # Planes go through one point: the control leaves other beams alone.
        assert rejected == 0
    else:
        assert rejected > 0.25 * free > 50


@each_core
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(("axis", "across"), [*itertools.permutations(range(3), 2)])
def test_rays_in_a_face_of_the_cell_are_kept(
    core: ModuleType, axis: int, across: int, sign: int
) -> None:
    """All numbers are zero there, so nothing is gained from a relative error bound."""
    origins, directions = np.zeros((2, 2, 3), np.float32)
    origins[:, axis] = -sign
    directions[:, axis] = sign, 2 * sign
    ends = np.zeros(2, np.float32), np.full(2, np.inf, np.float32)
    beam = core.mlrta_selftest.ray_beam(origins, directions, *ends, True)
    for lo, hi in ((-1, 0), (0, 1), (0, 0)):
        cell = np.array([(-1, -1, -1), (1, 1, 1)], np.float32)
        cell[:, across] = lo, hi
        lower, upper = (tuple(map(float, corner)) for corner in cell)
        for position in (-0.5 * sign, 0.0, 0.5 * sign, float(sign)):
            answer = core.mlrta_selftest.cull_children(beam, lower, upper, axis, position)
            assert answer == "both", (lo, hi, position)
        for test in LEAF_TESTS:
            assert getattr(core.mlrta_selftest, test)(beam, lower, upper), (test, lo, hi)


@each_core
@pytest.mark.parametrize("upwards", [False, True])
def test_rays_from_both_sides_of_a_face_that_all_leave_it(
    core: ModuleType, upwards: bool
) -> None:
    """Some start in the slab, some beyond it; none can come back."""
    sign = 1 if upwards else -1
    origins = np.array([(0, 0.75 * sign, 0), (0, 1.5 * sign, 0)], np.float32)
    directions = np.array([(1, 0.5 * sign, 0), (1, 0.75 * sign, 0)], np.float32)
    ends = np.zeros(2, np.float32), np.full(2, np.inf, np.float32)
    beam = core.mlrta_selftest.ray_beam(origins, directions, *ends, False)
    answer = core.mlrta_selftest.cull_children(beam, (-1, -1, -1), (2, 1, 1), 0, 1)
    assert answer == "near_only"


@each_core
def test_slopes_reject_what_parameters_reject(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    both = slopes_only = 0
    for _ in range(400):
        beam, origins, directions, _ = made_beam(core, rng, True)
        for _ in range(6):
            cell = random_cell(rng, origins, directions)
            by_parameters = core.mlrta_selftest.may_enter_by_parameters(beam, *cell)
            by_slopes = core.mlrta_selftest.may_enter_by_slopes(beam, *cell)
            assert by_parameters or not by_slopes
            both += not by_parameters
            slopes_only += by_parameters and not by_slopes
    assert min(both, slopes_only) > 20


@each_core
def test_figure_of_the_paper(core: ModuleType) -> None:
    """Rays that go up and right, below the cell where they cross x = 1: far only."""
    origins = np.zeros((2, 3), np.float32) + snap((0, -1, 0.5))
    directions = np.array([(1, 0.25, 0), (1, 0.5, 0)], np.float32)
    ends = np.zeros(2, np.float32), np.full(2, np.inf, np.float32)
    beam = core.mlrta_selftest.ray_beam(origins, directions, *ends, True)
    cull_children = core.mlrta_selftest.cull_children
    assert cull_children(beam, (0.5, 0, 0), (2, 1, 1), 0, 1) == "far_only"
    # The same rays have left a cell that they start beside and pass above.
    assert cull_children(beam, (0.5, -1, 0), (2, -0.875, 1), 0, 1) == "near_only"
