"""The figures of a tree's report, against a walk in Python and against the builder."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import workloads
from kd_trees import BuiltTree

from mlrt_plugin import KdTree, MlrtWarning
from mlrt_plugin._dispatch import core

SEED = 20261124

SCENES: dict[str, Callable[[np.random.Generator], workloads.Scene]] = {
    "soup": lambda rng: workloads.soup(rng, 400),
    "box": lambda rng: workloads.box(),
    "sphere": lambda rng: workloads.sphere(),
    "flat": workloads.flat,
    "one": lambda rng: workloads.soup(rng, 1),
}
COSTS: dict[str, Any] = {"traversal_cost": 2.5, "intersection_cost": 4.0}


@pytest.fixture(params=SCENES)
def scene(request: pytest.FixtureRequest) -> workloads.Scene:
    return SCENES[request.param](np.random.default_rng(SEED))


def walked(tree: BuiltTree) -> dict[str, Any]:
    """The figures as a walk in double precision finds them."""
    visits = list(tree.walk())
    scene_area = visits[0].area
    inner = [v for v in visits if not tree.is_leaf(v.node)]
    leaves = [v for v in visits if tree.is_leaf(v.node)]
    counts = [int(tree.count[v.node]) for v in leaves]
    flat = [v for v in leaves if (v.lo == v.hi).any() and tree.count[v.node]]
    sizes = Counter(counts)
    kept = len(tree.triangles) - tree.report["dropped_triangles"]
    traversals = sum(v.area for v in inner) / scene_area
    primitives = sum(v.area * n for v, n in zip(leaves, counts, strict=True)) / scene_area
    return {
        "nodes": len(visits),
        "inner_nodes": len(inner),
        "leaves": len(leaves),
        "empty_leaves": sizes[0],
        "flat_leaves": len(flat),
        "references": sum(counts),
        "max_leaf_count": max(counts),
        "depth": max(v.depth for v in visits),
        "leaf_histogram": [sizes[n] for n in range(16)],
        "expected_traversals": pytest.approx(traversals, rel=1e-9),
        "expected_leaf_visits": pytest.approx(
            sum(v.area for v in leaves) / scene_area, rel=1e-9
        ),
        "expected_primitive_visits": pytest.approx(primitives, rel=1e-9),
        "sah_cost": pytest.approx(traversals + 4.0 / 2.5 * primitives, rel=1e-9),
        "references_per_triangle": sum(counts) / kept,
        "references_per_nonempty_leaf": sum(counts) / (len(counts) - sizes[0]),
        "node_bytes": 8 * len(tree.axis),
        "reference_bytes": 4 * len(tree.references),
        "triangle_bytes": 36 * len(tree.triangles),
        "total_bytes": 8 * len(tree.axis)
        + 4 * len(tree.references)
        + 36 * len(tree.triangles),
    }


@pytest.mark.parametrize("builder", ["exact", "fast"])
def test_the_report_is_what_a_walk_finds(scene: workloads.Scene, builder: str) -> None:
    vertices, faces = scene
    expected = walked(BuiltTree(vertices[faces], builder=builder, **COSTS))
    report = KdTree(vertices, faces, builder=builder, **COSTS).report
    assert report["builder"] == builder
    assert report["built_share"] == 1
    assert {name: report[name] for name in expected} == expected


@pytest.mark.parametrize("builder", ["exact", "fast"])
def test_the_builder_counts_the_same(scene: workloads.Scene, builder: str) -> None:
    tree = KdTree(*scene, builder=builder, **COSTS)
    built, found = tree._tree.report, core.tree_statistics(tree._tree)
    both = set(built) & set(found)
    assert both >= {"inner_nodes", "leaves", "empty_leaves", "references", "depth"}
    assert {name: built[name] for name in both} == {name: found[name] for name in both}
    assert built["sah_cost"] == pytest.approx(tree.report["sah_cost"], rel=1e-9)


def test_a_lazy_tree_is_told_as_far_as_it_is_built() -> None:
    scene = workloads.soup(np.random.default_rng(SEED), 3000, 0.01)
    tree = KdTree(*scene, builder="lazy")
    before = tree.report
    assert before["unbuilt_cells"] == before["nodes"] == 1
    assert before["unbuilt_references"] == 3000
    assert before["built_share"] == before["leaves"] == before["references"] == 0
    assert before["waiting_bytes"] >= 28 * 3000
    assert before["total_bytes"] == 8 + 36 * 3000 + before["waiting_bytes"]
    tree.closest_hit([[0.1, 0.2, -3]], [[0.0, 0.1, 1]])
    during = tree.report
    assert 0 < during["unbuilt_references"] < 3000
    assert during["built_share"] == 1 - during["unbuilt_references"] / 3000
    assert during["leaves"] > 0
    assert during["inner_nodes"] + 1 == during["leaves"] + during["unbuilt_cells"]
    assert during["node_bytes"] == 8 * during["nodes"]
    assert during["reference_bytes"] == 4 * during["references"]
    core.finish_tree(tree._tree)
    after, fast = tree.report, KdTree(*scene, builder="fast").report
    assert after["built_share"] == 1
    assert after["unbuilt_cells"] == after["unbuilt_references"] == 0
    assert after["waiting_bytes"] == 0
    for name in ("nodes", "leaves", "references", "depth", "total_bytes", "leaf_histogram"):
        assert after[name] == fast[name]


def test_a_tree_that_is_one_leaf() -> None:
    triangle = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])
    report = KdTree(*triangle).report
    assert report["expected_traversals"] == 0
    assert report["expected_leaf_visits"] == report["expected_primitive_visits"] == 1
    assert report["sah_cost"] == 0.25
    assert report["flat_leaves"] == report["leaves"] == 1


def test_an_empty_tree() -> None:
    report = KdTree(np.zeros((0, 3)), np.zeros((0, 3), int)).report
    assert report["leaves"] == report["empty_leaves"] == report["nodes"] == 1
    for name in ("expected_traversals", "expected_leaf_visits", "sah_cost", "references"):
        assert report[name] == 0
    assert report["references_per_triangle"] == 0


def test_dropped_triangles_are_numbered() -> None:
    vertices, faces = workloads.soup(np.random.default_rng(SEED), 30)
    vertices[faces[4, 1], 2] = np.nan
    vertices[faces[11, 0]] = np.inf
    faces[20, 2] = faces[20, 0]
    with pytest.warns(MlrtWarning, match="2 of 30 faces"):
        tree = KdTree(vertices, faces)
    assert tree.report["dropped_triangles"] == 3
    assert core.tree_dropped(tree._tree).tolist() == [4, 11, 20]
