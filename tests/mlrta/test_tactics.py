"""Rays without a common origin: packets where they go together, one by one where not."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
import workloads
from tracing import BRUTE_FORCE, Options, build, closest, each_core, interval, occluded
from workloads import Rays

RaysOf = Callable[[np.random.Generator], Rays]
SEED = 20261128
COUNT = 4096

ADAPTIVE: Options = {"traversal": "adaptive"}
PACKETS: Options = {"traversal": "packet"}
SINGLES: Options = {"traversal": "single"}


def together(rng: np.random.Generator) -> Rays:
    """Parallel rays through a square, neighbours in Morton order."""
    bits = np.arange(COUNT)
    column = sum((bits >> 2 * k & 1) << k for k in range(6))
    row = sum((bits >> 2 * k + 1 & 1) << k for k in range(6))
    origins = np.stack([column / 64, row / 64, np.full(COUNT, -1.0)], axis=1)
    directions = np.tile(np.float32([0.01, 0.02, 1]), (COUNT, 1))
    return origins.astype(np.float32), directions


def apart(rng: np.random.Generator) -> Rays:
    """Rays from anywhere to anywhere."""
    origins = rng.uniform(0, 1, (COUNT, 3)).astype(np.float32)
    return origins, rng.normal(size=(COUNT, 3)).astype(np.float32)


@each_core
@pytest.mark.parametrize(("rays_of", "better"), [(together, PACKETS), (apart, SINGLES)])
def test_the_faster_way_is_taken(
    core: ModuleType, rays_of: RaysOf, better: Options
) -> None:
    """Packets visit fewer nodes, all rays counted, than rays do one by one: how many are
    visited tells which way was taken."""
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.05))
    rays = rays_of(rng)

    def steps(options: Options) -> int:
        counters: dict[str, int] = {}
        tree.closest_hit(*rays, *interval(rays, 0, np.inf), options, counters)
        assert counters["rays"] == COUNT
        return counters["traversal_steps"]

    taken, packets, singles = steps(ADAPTIVE), steps(PACKETS), steps(SINGLES)
    assert packets < 0.8 * singles
    share_of_singles = (taken - packets) / (singles - packets)
    assert share_of_singles > 0.8 if better is SINGLES else share_of_singles < 0.2, SEED


@each_core
@pytest.mark.parametrize("rays_of", [together, apart])
def test_both_ways_find_what_brute_force_does(core: ModuleType, rays_of: RaysOf) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 300, 0.2))
    rays = rays_of(rng)
    t_max = rng.choice(np.array([np.inf, 0.7, 0.2], np.float32), COUNT)
    expected = closest(tree, rays, BRUTE_FORCE, t_max=t_max)
    for options in (ADAPTIVE, SINGLES):
        closest(tree, rays, options, t_max=t_max).assert_same(expected)
        hit = occluded(tree, rays, options, t_max=t_max)
        assert np.array_equal(hit, expected.face >= 0), SEED


@each_core
@pytest.mark.parametrize("count", [100, 256, COUNT])
def test_rays_that_go_apart_take_the_wide_tree_at_once(
    core: ModuleType, count: int
) -> None:
    """Where it is there they take as many steps as without a choice. Others may try all
    ways."""
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.05))
    tree.widen()
    for rays_of in (apart, together):
        origins, directions = (array[:count].copy() for array in rays_of(rng))
        if rays_of is apart:
            directions[3::50] = np.nan
            directions[5::50] = 0
        rays = origins, directions
        bounds = interval(rays, 0, np.inf)
        steps: dict[tuple[str, str], int] = {}
        for traversal in ("adaptive", "wide"):
            counters: dict[str, int] = {}
            tree.closest_hit(*rays, *bounds, {"traversal": traversal}, counters)
            steps[traversal, "closest"] = counters["traversal_steps"]
            tree.any_hit(*rays, *bounds, {"traversal": traversal}, counters)
            steps[traversal, "any"] = counters["traversal_steps"]
        is_same = steps["adaptive", "closest"] == steps["wide", "closest"]
        assert is_same == (rays_of is apart), SEED
        if rays_of is apart:
            assert steps["adaptive", "any"] == steps["wide", "any"], SEED
        closest(tree, rays, ADAPTIVE).assert_same(closest(tree, rays, BRUTE_FORCE))
        expected = closest(tree, rays, BRUTE_FORCE).face >= 0
        assert np.array_equal(occluded(tree, rays, ADAPTIVE), expected), SEED
