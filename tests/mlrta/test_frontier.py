"""Frontiers: disjoint subtrees, front to back, with all that a beam may hit in them."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any

import beams
import kd_trees
import numpy as np
import oracles
import pytest
import workloads
from tracing import BRUTE_FORCE, Options, build, closest, each_core
from trees_of_beams import Path, judge, last_common, possible_leaves

SEED = 1968
Cell = tuple[tuple[float, ...], tuple[float, ...]]
EXACTLY: Options = {"covering_triangles": False}


def beam_of(core: ModuleType, rays: workloads.Rays, common_origin: bool) -> Any:
    count = len(rays[0])
    ends = np.zeros(count, np.float32), np.full(count, np.inf, np.float32)
    return core.mlrta_selftest.ray_beam(*rays, *ends, common_origin)


def aimed(rng: np.random.Generator, common_origin: bool) -> workloads.Rays:
    """Returns a narrow bundle of rays into the box [-1, 1]^3."""
    origins, directions = beams.bundle(rng, 6, common_origin, spread=0.1)
    across = directions - directions[0]
    towards = workloads.snap(rng.uniform(-0.7, 0.7, 3)) - origins[0]
    return origins, (towards + across).astype(np.float32)


def scenes(rng: np.random.Generator) -> list[workloads.Scene]:
    return [workloads.soup(rng, 100), workloads.stairs(), workloads.sphere(2)]


@each_core
@pytest.mark.parametrize("builder", ["exact", "fast"])
@pytest.mark.parametrize("common_origin", [True, False])
def test_frontiers_are_made_of_entry_points(
    core: ModuleType, builder: str, common_origin: bool
) -> None:
    rng = np.random.default_rng(SEED)
    large = 0
    for scene in scenes(rng):
        tree = build(core, scene, builder=builder)
        nodes = core.mlrta_selftest.nodes_of(tree)
        for _ in range(20):
            rays = aimed(rng, common_origin)
            beam = beam_of(core, rays, common_origin)
            tests = judge(core, beam, "slopes")
            leaves = list(possible_leaves(nodes, (0,), *tree.bounds, *tests))
            for capacity in (1, 2, 4, 8, 16):
                frontier = core.mlrta_selftest.frontier(tree, beam, capacity, EXACTLY)
                entries = [entry[0] for entry in frontier]
                assert len(entries) <= capacity
                below: dict[int, list[Path]] = {node: [] for node in entries}
                for path in leaves:
                    (entry,) = (node for node in path if node in below)
                    below[entry].append(path)
                for entry, paths in below.items():
                    assert last_common(paths) == entry, (SEED, rays, capacity)
                if capacity == 1:
                    single = core.mlrta_selftest.entry_point(tree, beam, EXACTLY)
                    assert entries == ([] if single is None else [single])
                large += len(entries) > 3
    assert large > 50


def first_meeting(origin: Any, direction: Any, lo: Any, hi: Any) -> Fraction | None:
    """Returns the parameter at which a ray first meets a closed box."""
    near, far = Fraction(0), None
    for o, d, low, high in zip(origin, direction, lo, hi, strict=True):
        o, d, low, high = (Fraction(float(x)) for x in (o, d, low, high))
        if d == 0:
            if not low <= o <= high:
                return None
            continue
        first, last = sorted(((low - o) / d, (high - o) / d))
        near = max(near, first)
        far = last if far is None else min(far, last)
    return near if far is None or near <= far else None


@each_core
def test_frontiers_go_front_to_back(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    pairs = 0
    for scene in scenes(rng):
        tree = build(core, scene)
        for _ in range(25):
            rays = aimed(rng, True)
            beam = beam_of(core, rays, True)
            frontier = core.mlrta_selftest.frontier(tree, beam, 16)
            for ray in zip(*rays, strict=True):
                last = Fraction(0)
                for _, lo, hi, earliest_hit in frontier:
                    t = first_meeting(*ray, lo, hi)
                    if t is not None:
                        assert last <= t, (SEED, ray, frontier)
                        assert earliest_hit <= t
                        pairs += last > 0
                        last = t
    assert pairs > 200


@each_core
@pytest.mark.parametrize("capacity", [1, 4, 16])
@pytest.mark.parametrize("common_origin", [True, False])
@pytest.mark.parametrize("builder", ["exact", "fast"])
def test_first_hits_lie_below_the_frontier(
    core: ModuleType, builder: str, capacity: int, common_origin: bool
) -> None:
    """With covering triangles too, which may cut off anything but first hits."""
    rng = np.random.default_rng(SEED)
    hits = 0
    for vertices, faces in scenes(rng):
        built = kd_trees.BuiltTree(vertices[faces], builder=builder)
        tree = build(core, (vertices, faces), builder=builder)
        child = {node: int(built.child[node]) for node in range(len(built.axis))
                 if not built.is_leaf(node)}  # fmt: skip
        assert len(core.mlrta_selftest.nodes_of(tree)) == len(built.axis)
        leaves = list(built.leaves())
        for _ in range(8):
            rays = aimed(rng, common_origin)
            found = closest(tree, rays, BRUTE_FORCE)
            beam = beam_of(core, rays, common_origin)
            frontier = core.mlrta_selftest.frontier(tree, beam, capacity)
            below = [entry[0] for entry in frontier]
            for node in below:
                below += [child[node], child[node] + 1] if node in child else []
            for origin, direction, t, face in zip(*rays, found.t, found.face, strict=True):
                if face < 0:
                    continue
                hits += 1
                reach = float(np.nextafter(t, np.float32(np.inf)))
                assert any(
                    visit.node in below
                    and face in built.referenced(visit.node)
                    and oracles.segment_meets_box(
                        origin, direction, reach, visit.lo, visit.hi
                    )
                    for visit in leaves
                ), (SEED, origin, direction, face)
    assert hits > 60
