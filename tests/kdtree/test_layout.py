"""The arrays of a tree are well formed, and its report says what they hold."""

from __future__ import annotations

import numpy as np
import pytest
import workloads
from kd_trees import BuiltTree

from mlrt_plugin._dispatch import core

SEED = 20260107


@pytest.fixture(params=["soup", "box", "sphere", "stairs", "flat"])
def tree(request: pytest.FixtureRequest) -> BuiltTree:
    rng = np.random.default_rng(SEED)
    scene = {
        "soup": lambda: workloads.soup(rng, 400),
        "box": workloads.box,
        "sphere": workloads.sphere,
        "stairs": workloads.stairs,
        "flat": lambda: workloads.flat(rng),
    }[request.param]()
    return BuiltTree(scene[0][scene[1]])


def test_nodes_are_visited_once_and_planes_lie_in_their_cells(tree: BuiltTree) -> None:
    visits = list(tree.walk())
    assert sorted(v.node for v in visits) == list(range(len(tree.axis)))
    for visit in visits:
        if not tree.is_leaf(visit.node):
            axis = int(tree.axis[visit.node])
            assert tree.child[visit.node] > visit.node
            assert visit.lo[axis] <= tree.split[visit.node] <= visit.hi[axis]
            assert visit.lo[axis] < visit.hi[axis], (
                "a flat cell is not split along its axis"
            )


def test_references_follow_the_leaves_in_order(tree: BuiltTree) -> None:
    end = 0
    for visit in tree.walk():
        if tree.is_leaf(visit.node) and tree.count[visit.node]:
            assert tree.first_reference[visit.node] == end
            end += int(tree.count[visit.node])
            held = tree.referenced(visit.node)
            assert held == sorted(set(held))
    assert end == len(tree.references)


def test_the_report_counts_what_is_there(tree: BuiltTree) -> None:
    visits = list(tree.walk())
    leaves = [v.node for v in visits if tree.is_leaf(v.node)]
    report = tree.report
    assert report["leaves"] == len(leaves)
    assert report["inner_nodes"] == len(visits) - len(leaves)
    assert report["empty_leaves"] == sum(tree.count[leaf] == 0 for leaf in leaves)
    assert report["max_leaf_count"] == max(tree.count[leaf] for leaf in leaves)
    assert report["references"] == len(tree.references)
    assert report["depth"] == tree.depth == max(v.depth for v in visits)
    # K_T = 1 for an inner node and K_I = 0.25 for a reference, by the chance to enter it.
    cost = sum(
        v.area
        / visits[0].area
        * (0.25 * int(tree.count[v.node]) if tree.is_leaf(v.node) else 1.0)
        for v in visits
    )
    assert report["sah_cost"] == pytest.approx(cost, rel=1e-9)
    assert report["seconds"] > 0


def test_two_builds_give_the_same_bytes(tree: BuiltTree) -> None:
    again = BuiltTree(tree.triangles)
    for a, b in zip(tree.arrays, again.arrays, strict=True):
        assert a.tobytes() == b.tobytes()
    assert tree.references.tobytes() == again.references.tobytes()


@pytest.mark.parametrize("exponent", [-60, -40, 30])
def test_scaling_by_a_power_of_two_changes_nothing_else(
    tree: BuiltTree, exponent: int
) -> None:
    scaled = BuiltTree(np.ldexp(tree.triangles, exponent))
    assert (scaled.axis == tree.axis).all()
    assert (scaled.split == np.ldexp(tree.split, exponent)).all()
    assert (scaled.child == tree.child).all()
    assert (scaled.references == tree.references).all()


def test_no_path_is_longer_than_stacks_allow() -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 3000, 0.5)
    limit = core.kdtree_selftest.max_tree_depth
    for wanted, allowed in ((0, limit), (limit, limit), (7, 7), (1, 1)):
        options = {"max_depth": wanted, "area_floor": 1e-12, "intersection_cost": 50.0}
        assert 0 < BuiltTree(scene[0][scene[1]], **options).depth <= allowed
    with pytest.raises(ValueError, match="max_depth"):
        BuiltTree(scene[0][scene[1]], max_depth=limit + 1)
