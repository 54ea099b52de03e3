"""The event sweep builds the tree that the rules ask for, plane by plane."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from kd_trees import BuiltTree
from reference_builder import Node, Options, ReferenceBuilder

from mlrt_plugin._dispatch import core

SEED = 20260105
FloatArray = npt.NDArray[np.float32]


def soup(rng: np.random.Generator, count: int, size: float) -> FloatArray:
    centres = rng.uniform(-1, 1, (count, 1, 3))
    return (centres + rng.normal(0, size, (count, 3, 3))).astype(np.float32)


def quad(axis: int, position: float, lo: FloatArray, hi: FloatArray) -> FloatArray:
    """Returns the rectangle {x[axis] = position} of a box as two triangles."""
    corners = np.full((4, 3), position)
    u, v = (axis + 1) % 3, (axis + 2) % 3
    corners[:, u] = [lo[u], hi[u], hi[u], lo[u]]
    corners[:, v] = [lo[v], lo[v], hi[v], hi[v]]
    return corners[[[0, 1, 2], [0, 2, 3]]].astype(np.float32)


def rooms(rng: np.random.Generator, boxes: int) -> FloatArray:
    """Returns axis-aligned boxes on and in one another, with many planes in common."""
    lo, hi = np.array([-1.0, -1.1, -1.2]), np.array([1.3, 1.2, 1.1])
    faces = [quad(k, side[k], lo, hi) for k in range(3) for side in (lo, hi)]
    for _ in range(boxes):
        a, b = np.sort(rng.uniform(lo, hi, (2, 3)), axis=0)
        a[2] = lo[2] if rng.uniform() < 0.5 else a[2]
        faces += [quad(k, side[k], a, b) for k in range(3) for side in (a, b)]
    faces.append(quad(0, rng.uniform(-0.5, 0.5), lo, hi))
    return np.concatenate(faces)


def assert_equal(tree: BuiltTree, node: int, expected: Node, path: str = "root") -> None:
    where = f"seed {SEED}, {path} ({expected.rule})"
    if expected.plane is None or expected.children is None:
        assert tree.is_leaf(node), where
        assert tree.referenced(node) == expected.triangles, where
        return
    assert not tree.is_leaf(node), where
    assert (tree.axis[node], tree.split[node]) == expected.plane[:2], where
    for i, child in enumerate(expected.children):
        assert_equal(tree, int(tree.child[node]) + i, child, f"{path}.{i}")


def count_rule(node: Node, rule: str) -> int:
    below = sum(count_rule(child, rule) for child in node.children or ())
    return below + (node.rule == rule)


SCENES = {
    "soup": lambda rng: soup(rng, 70, 0.15),
    "sparse": lambda rng: soup(rng, 70, 0.02),
    "dense": lambda rng: soup(rng, 40, 0.6),
    "rooms": lambda rng: rooms(rng, 3),
    "mixed": lambda rng: np.concatenate([rooms(rng, 1), soup(rng, 30, 0.05)]),
}
SWITCHES: list[dict[str, Any]] = [
    {},
    {"clip": False},
    {"rule_empty_cell": False},
    {"rule_flat_cell": False},
    {"rule_area_floor": False, "max_depth": 9},
    {"intersection_cost": 4.0, "empty_bonus": 1.0, "area_floor": 0.01},
    {"traversal_cost": 2.0, "empty_cell_share": 0.3, "max_depth": 5},
]


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("options", SWITCHES, ids=lambda o: "-".join(o) or "default")
def test_equals_the_reference(scene: str, options: dict[str, Any]) -> None:
    rng = np.random.default_rng(SEED)
    triangles = SCENES[scene](rng)
    tree = BuiltTree(triangles, **options)
    reference = ReferenceBuilder(triangles, Options(**options)).tree
    assert_equal(tree, 0, reference)
    assert tree.report["sah_cost"] == pytest.approx(
        reference.cost / options.get("traversal_cost", 1.0), rel=1e-9
    )
    for name, rule in (
        ("empty_cell_splits", "empty cell"),
        ("flat_cell_splits", "flat cell"),
        ("area_floor_leaves", "area floor"),
    ):
        assert tree.report[name] == count_rule(reference, rule)
    if scene == "rooms" and not options:
        assert tree.report["flat_cell_splits"] > 0
        assert tree.report["empty_cell_splits"] > 0


def test_split_cost_equals_the_formula() -> None:
    rng = np.random.default_rng(SEED)
    for _ in range(500):
        lo, hi = np.sort(rng.uniform(-9, 9, (2, 3)).astype(np.float32), axis=0)
        axis = int(rng.integers(3))
        position = np.float32(rng.uniform(lo[axis], hi[axis]))
        counts = [int(c) for c in rng.integers(0, 4, 2)]

        def area(a: FloatArray, b: FloatArray) -> float:
            sides = np.float64(b) - np.float64(a)
            return float(2 * (sides.prod() / sides).sum())

        lower_hi, upper_lo = hi.copy(), lo.copy()
        lower_hi[axis] = upper_lo[axis] = position
        expected = 1.5 + 2.5 * (
            area(lo, lower_hi) / area(lo, hi) * counts[0]
            + area(upper_lo, hi) / area(lo, hi) * counts[1]
        )
        expected *= 0.75 if 0 in counts else 1.0
        found = core.kdtree_selftest.split_cost(
            lo.tolist(),
            hi.tolist(),
            axis,
            float(position),
            *counts,
            traversal_cost=1.5,
            intersection_cost=2.5,
            empty_bonus=0.75,
        )
        assert found == pytest.approx(expected, rel=1e-12), f"seed {SEED}"
