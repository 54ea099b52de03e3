"""The entry point search: which nodes it visits, and that its answer is the deepest one."""

from __future__ import annotations

import itertools
from types import ModuleType

import beams
import numpy as np
import pytest
import workloads
from tracing import Options, build, each_core
from trees_of_beams import judge, last_common, possible_leaves

SEED = 2005

# The tree of figure 6 of Reshetov et al. 2005: children of inner nodes, near child first.
# What hangs below nodes that the beam doesn't reach is left out.
FIGURE = {
    1: (21, 22),
    21: (31, 32),
    31: (41, 42),
    41: (51, 52),
    51: (61, 62),
    52: (63, 64),
    64: (71, 72),
    72: (81, 82),
    32: (43, 44),
    44: (53, 54),
}
CULLED = {22, 42, 62}
EMPTY = {43, 53, 81}


def search_figure(
    core: ModuleType, impossible: set[int], shallow_first: bool = False
) -> tuple[int | None, list[int]]:
    """Returns the entry point and the visited nodes, by their labels in the figure."""
    labels = [1]
    children = {}
    for label in labels:
        if label in FIGURE:
            children[labels.index(label)] = len(labels)
            labels.extend(FIGURE[label])

    def numbers(some: set[int]) -> set[int]:
        return {labels.index(label) for label in some}

    entry, visited = core.mlrta_selftest.search_table(
        len(labels),
        children,
        numbers(EMPTY),
        numbers(CULLED),
        numbers(impossible),
        shallow_first,
    )
    return None if entry is None else labels[entry], [labels[node] for node in visited]


@each_core
def test_figure_of_the_paper(core: ModuleType) -> None:
    entry, visited = search_figure(core, set())
    assert visited == [1, 21, 31, 41, 51, 61, 52, 63, 32, 43, 44, 53, 54]
    assert entry == 21


@each_core
def test_shallow_first_visits_fewer_nodes(core: ModuleType) -> None:
    entry, visited = search_figure(core, set(), shallow_first=True)
    assert visited == [1, 21, 31, 41, 51, 61, 32, 43, 44, 53, 54]
    assert entry == 21


@each_core
def test_bifurcations_found_later_are_no_candidates(core: ModuleType) -> None:
    """Without 54 the answer is 41. Leaf 61 would be lost in 52, met while its side was
    searched."""
    entry, visited = search_figure(core, {54})
    assert visited[-1] == 54
    assert entry == 41


@each_core
def test_barren_sides_are_no_candidates(core: ModuleType) -> None:
    """Without 61 the first possible leaf is 63, and 41 has nothing on its other side."""
    entry, visited = search_figure(core, {61, 54})
    assert visited[:7] == [1, 21, 31, 41, 51, 61, 52]
    assert entry == 52
    assert search_figure(core, {61, 63, 71, 82, 54})[0] is None


@each_core
def test_answer_is_the_lowest_common_ancestor_of_possible_leaves(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    misses = inner = leaves = 0
    for _ in range(3000):
        children: dict[int, int] = {}
        parent = {0: -1}
        for _ in range(rng.integers(0, 40)):
            ends = [node for node in parent if node not in children]
            split = int(rng.choice(ends))
            children[split] = len(parent)
            parent |= {len(parent): split, len(parent) + 1: split}
        count = len(parent)
        culled, impossible, empty = (
            set(np.flatnonzero(rng.random(count) < rng.choice([0, 0.1, 0.4])).tolist())
            for _ in range(3)
        )
        paths = []
        for leaf in set(parent) - set(children) - impossible - empty:
            path = [leaf]
            while parent[path[-1]] >= 0:
                path.append(parent[path[-1]])
            if not culled.intersection(path[:-1]):
                paths.append(tuple(reversed(path)))
        tables = count, children, empty, culled, impossible
        entry, visited = core.mlrta_selftest.search_table(*tables, False)
        assert entry == last_common(paths), (SEED, tables)
        assert len(set(visited)) == len(visited)
        again, fewer = core.mlrta_selftest.search_table(*tables, True)
        assert again == entry, (SEED, tables)
        assert set(fewer) <= set(visited) and len(set(fewer)) == len(fewer)
        misses += entry is None
        inner += entry in children
        leaves += entry is not None and entry not in children
    assert min(misses, inner, leaves) > 100


@each_core
@pytest.mark.parametrize("rejection", ["slopes", "parameters", "none"])
@pytest.mark.parametrize("common_origin", [True, False])
def test_beams_in_real_trees(core: ModuleType, rejection: str, common_origin: bool) -> None:
    rng = np.random.default_rng(SEED)
    deep = 0
    scenes = workloads.soup(rng, 100), workloads.stairs(), workloads.sphere(2)
    for scene, builder in itertools.product(scenes, ("exact", "fast")):
        tree = build(core, scene, builder=builder)
        nodes = core.mlrta_selftest.nodes_of(tree)
        for _ in range(25):
            origins, directions = beams.bundle(rng, 6, common_origin, spread=0.1)
            ends = np.zeros(6, np.float32), np.full(6, np.inf, np.float32)
            beam = core.mlrta_selftest.ray_beam(origins, directions, *ends, common_origin)
            lo, hi = tree.bounds
            paths = possible_leaves(nodes, (0,), lo, hi, *judge(core, beam, rejection))
            expected = last_common(list(paths))
            for order in ("paper", "shallow_first"):
                options: Options = {"leaf_rejection": rejection, "search_order": order}
                options["covering_triangles"] = False
                entry = core.mlrta_selftest.entry_point(tree, beam, options)
                assert entry == expected, (SEED, origins, directions, order)
            deep += entry not in (None, 0)
    assert deep > 5
