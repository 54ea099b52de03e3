"""Input that breaks builders: nothing, all in one place, too large, not a number."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from kd_trees import BUILDERS, LEAF, BuiltTree, each_builder

SEED = 20260109
FloatArray = npt.NDArray[np.float32]


def soup(count: int) -> FloatArray:
    vertices, faces = workloads.soup(np.random.default_rng(SEED), count)
    return vertices[faces]


def assert_empty(tree: BuiltTree) -> None:
    assert tree.axis.tolist() == [3]
    assert tree.count.tolist() == [0]
    assert len(tree.references) == tree.depth == 0
    assert (tree.lo > tree.hi).all()
    assert tree.report["sah_cost"] == 0
    assert tree.report["leaves"] == tree.report["empty_leaves"] == 1


@each_builder
def test_nothing_gives_an_empty_tree(builder: str) -> None:
    assert_empty(BuiltTree(np.zeros((0, 3, 3)), **BUILDERS[builder]))


@each_builder
def test_degenerate_triangles_alone_give_an_empty_tree(builder: str) -> None:
    points = np.repeat(np.random.default_rng(SEED).normal(size=(50, 1, 3)), 3, axis=1)
    tree = BuiltTree(points, **BUILDERS[builder])
    assert_empty(tree)
    assert tree.report["dropped_triangles"] == 50


@each_builder
def test_one_triangle_is_one_leaf(builder: str) -> None:
    tree = BuiltTree(soup(1), **BUILDERS[builder])
    assert tree.references.tolist() == [0]
    assert tree.axis.tolist() == [3]
    assert (tree.lo == tree.triangles.reshape(-1, 3).min(0)).all()


@each_builder
def test_two_triangles(builder: str) -> None:
    assert sorted(set(BuiltTree(soup(2), **BUILDERS[builder]).references.tolist())) == [
        0,
        1,
    ]


@each_builder
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_left_out_and_harms_nobody(
    builder: str, value: float
) -> None:
    good = soup(40)
    bad = good[:9].copy()
    for i in range(9):
        bad[i].flat[i] = value
    mixed = np.empty((49, 3, 3), np.float32)
    places = np.arange(0, 45, 5)
    mixed[places] = bad
    others = np.setdiff1d(np.arange(49), places)
    mixed[others] = good
    tree, expected = (
        BuiltTree(mixed, **BUILDERS[builder]),
        BuiltTree(good, **BUILDERS[builder]),
    )
    assert tree.report["dropped_triangles"] == 9
    for a, b in zip(tree.arrays, expected.arrays, strict=True):
        assert a.tobytes() == b.tobytes()
    assert tree.references.tolist() == others[expected.references].tolist()


@each_builder
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("position", [0.0, -7.25, 1e6])
def test_all_in_one_plane(builder: str, axis: int, position: float) -> None:
    triangles = soup(300)
    triangles[:, :, axis] = position
    tree = BuiltTree(triangles, **BUILDERS[builder])
    assert np.isfinite(tree.report["sah_cost"])
    assert np.isfinite(tree.expected_cost())
    assert tree.lo[axis] == tree.hi[axis] == np.float32(position)
    assert (tree.axis != axis).all()
    assert (tree.axis != LEAF).sum() > 50
    assert tree.count.max() < 100


@each_builder
@pytest.mark.parametrize("flat", [False, True])
def test_a_thousand_times_the_same_triangle(builder: str, flat: bool) -> None:
    triangle = soup(1)
    if flat:
        triangle[:, :, 1] = 0.5
    tree = BuiltTree(np.repeat(triangle, 1000, axis=0), **BUILDERS[builder])
    if builder == "exact":
        assert tree.axis.tolist() == [LEAF]
    # Bins offer planes through the triangle, which clipping makes worth their while.
    assert len(tree.axis) < 100
    assert tree.expected_cost() <= 1500
    for visit in tree.leaves():
        assert tree.referenced(visit.node) in ([], list(range(1000)))


@each_builder
def test_a_pile_beside_something_else_stays_bounded(builder: str) -> None:
    pile = np.repeat(soup(1), 2000, axis=0)
    tree = BuiltTree(np.concatenate([pile, soup(50) + np.float32(1)]), **BUILDERS[builder])
    assert len(tree.references) < 8 * 2050 + 65536
    assert (tree.axis != LEAF).sum() < 3000


@each_builder
def test_all_share_a_point(builder: str) -> None:
    rng = np.random.default_rng(SEED)
    triangles = np.concatenate(
        [np.full((2000, 1, 3), 0.3), rng.uniform(-1, 1, (2000, 2, 3))], axis=1
    )
    for rule in (False, True):
        tree = BuiltTree(triangles, rule_area_floor=rule, **BUILDERS[builder])
        assert len(tree.references) <= 8 * 2000 + 65536


@each_builder
@pytest.mark.parametrize("scale", [1e-38, 1e-30, 1e30, 1e38])
def test_extreme_extents_give_the_usual_tree(builder: str, scale: float) -> None:
    usual, tree = (
        BuiltTree(soup(200), **BUILDERS[builder]),
        BuiltTree(np.float64(soup(200)) * scale, **BUILDERS[builder]),
    )
    assert tree.report["dropped_triangles"] == 0
    assert tree.expected_cost() == pytest.approx(usual.expected_cost(), rel=0.02)
    assert sorted(set(tree.references.tolist())) == list(range(200))


@each_builder
def test_least_denormal_and_greatest_number(builder: str) -> None:
    least, greatest = 2.0**-149, float(np.finfo(np.float32).max)
    small = np.array([[0, 0, 0], [3, 1, 0], [0, 2, 5]]) * least
    large = np.array([[-1, -1, -1], [1, 1, -1], [1, -1, 1]]) * greatest
    tree = BuiltTree(np.array([small, large, small + least, -large]), **BUILDERS[builder])
    assert sorted(set(tree.references.tolist())) == [0, 1, 2, 3]
    assert np.isfinite(tree.report["sah_cost"])
