"""Leaves hold what lies in them: decided exactly, for every triangle and every leaf."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import exact_geometry as exact
import numpy as np
import numpy.typing as npt
import pytest
import workloads
from kd_trees import BUILDERS, BuiltTree, each_builder

SEED = 20260106
FloatArray = npt.NDArray[np.float32]


def corners_of(scene: workloads.Scene) -> FloatArray:
    vertices, faces = scene
    return vertices[faces]


def is_reachable(tree: BuiltTree, node: int, triangle: int, part: exact.Polygon) -> bool:
    """Whether each point of the part, which lies in the node's cell, is in a leaf that
    references the triangle.

    What reaches below a plane must be found below, above likewise. What lies in the plane
    may be on either side, the same for all of it.
    """
    if tree.is_leaf(node):
        return triangle in tree.referenced(node)
    axis, position = int(tree.axis[node]), Fraction(float(tree.split[node]))
    child = int(tree.child[node])
    below = any(p[axis] < position for p in part)
    above = any(p[axis] > position for p in part)
    if not below and not above:
        return any(is_reachable(tree, child + i, triangle, part) for i in range(2))
    return all(
        is_reachable(tree, child + i, triangle, exact.halve(part, axis, position, side))
        for i, side, wanted in ((0, -1, below), (1, 1, above))
        if wanted
    )


def lattice(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns triangles on a coarse grid: their planes, edges and vertices keep meeting."""
    triangles = rng.integers(0, 5, (count, 3, 3)).astype(np.float32)
    # A third of them lies in planes across an axis.
    for i in range(0, count, 3):
        triangles[i, :, i % 9 // 3] = triangles[i, 0, i % 9 // 3]
    return triangles


SCENES: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "soup": lambda rng: corners_of(workloads.soup(rng, 60)),
    "lattice": lambda rng: lattice(rng, 60),
    "lattice far out": lambda rng: lattice(rng, 60) + np.float32(1e6),
    "box": lambda rng: corners_of(workloads.box()),
    "sphere": lambda rng: corners_of(workloads.sphere(1)),
    "stairs": lambda rng: corners_of(workloads.stairs(6)),
    "slivers": lambda rng: corners_of(workloads.slivers(rng, 40)),
    "fan": lambda rng: corners_of(workloads.fan(60)),
    "flat": lambda rng: corners_of(workloads.flat(rng, 60)),
    "duplicates": lambda rng: corners_of(workloads.duplicates(rng, 60)),
}
SWITCHES: list[dict[str, Any]] = [
    {},
    {"clip": False},
    {"rule_empty_cell": False, "rule_flat_cell": False, "intersection_cost": 8.0},
]


@each_builder
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("options", SWITCHES, ids=lambda o: "-".join(o) or "default")
def test_no_point_of_a_triangle_is_lost(
    builder: str, scene: str, options: dict[str, Any]
) -> None:
    triangles = SCENES[scene](np.random.default_rng(SEED))
    tree = BuiltTree(triangles, **BUILDERS[builder], **options)
    dropped = 0
    for i, triangle in enumerate(tree.triangles):
        if i not in tree.references:
            dropped += 1
            corners = np.float64(triangle)
            assert not np.cross(corners[1] - corners[0], corners[2] - corners[0]).any()
            continue
        assert is_reachable(tree, 0, i, exact.polygon(triangle)), (
            f"seed {SEED}: triangle {i}"
        )
    assert dropped == tree.report["dropped_triangles"]


@each_builder
@pytest.mark.parametrize(
    "scene", ["soup", "lattice", "lattice far out", "sphere", "stairs"]
)
def test_no_leaf_holds_what_it_does_not_touch(builder: str, scene: str) -> None:
    tree = BuiltTree(SCENES[scene](np.random.default_rng(SEED)), **BUILDERS[builder])
    for visit in tree.walk():
        if tree.is_leaf(visit.node):
            for i in tree.referenced(visit.node):
                corners = exact.polygon(tree.triangles[i])
                part = exact.clip(corners, exact.point(visit.lo), exact.point(visit.hi))
                assert part, f"seed {SEED}: triangle {i} in leaf {visit.node}"


@each_builder
@pytest.mark.parametrize("scene", SCENES)
def test_bounds_are_those_of_the_references(builder: str, scene: str) -> None:
    tree = BuiltTree(SCENES[scene](np.random.default_rng(SEED)), **BUILDERS[builder])
    used = tree.triangles[np.unique(tree.references)].reshape(-1, 3)
    assert (tree.lo == used.min(0)).all()
    assert (tree.hi == used.max(0)).all()
