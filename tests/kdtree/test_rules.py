"""Each of the paper's rules fires on the scene made for it and on no other."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from kd_trees import BuiltTree

SEED = 20260108
FloatArray = npt.NDArray[np.float32]
NOTHING_ELSE = {"intersection_cost": 1e-6, "rule_area_floor": False}  # no split pays by SAH


def rectangle(axis: int, position: float, lo: float, hi: float) -> FloatArray:
    """Returns two triangles in the plane {x[axis] = position}."""
    corners = np.full((4, 3), position)
    corners[:, (axis + 1) % 3] = [lo, hi, hi, lo]
    corners[:, (axis + 2) % 3] = [lo, lo, hi, hi]
    return corners[[[0, 1, 2], [0, 2, 3]]].astype(np.float32)


def diagonal(lo: list[float], hi: list[float]) -> FloatArray:
    """Returns a triangle in no plane across an axis, whose bounds are the given box."""
    return np.array([[lo, [hi[0], hi[1], lo[2]], [hi[0], lo[1], hi[2]]]], np.float32)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("upper", [False, True])
@pytest.mark.parametrize(("length", "fires"), [(9.0, True), (9.03125, False)])
def test_empty_cells_are_cut_off_from_a_tenth(
    axis: int, upper: bool, length: float, fires: bool
) -> None:
    """After a wall is taken out of [0, 10], one triangle is left in `length` of it."""
    bounds = np.array([[0.0, 0.0, 0.0], [10.0, 10.0, 10.0]])
    bounds[0 if upper else 1, axis] = 10 - length if upper else length
    inner = diagonal(bounds[0].tolist(), bounds[1].tolist())
    wall = rectangle(axis, 0.0 if upper else 10.0, 0.0, 10.0)
    # A hair above 0.1 as float32; the ratio is compared in double.
    share = float(np.float32(0.1)) if not fires else 0.0999
    triangles = np.concatenate([inner, wall])
    tree = BuiltTree(triangles, empty_cell_share=share, **NOTHING_ELSE)
    assert tree.report["flat_cell_splits"] == 1
    assert (tree.axis[0], tree.split[0]) == (axis, wall[0, 0, axis])
    assert tree.report["empty_cell_splits"] == int(fires)
    off = BuiltTree(triangles, rule_empty_cell=False, **NOTHING_ELSE)
    assert off.report["empty_cell_splits"] == 0


def test_the_largest_empty_part_goes_first() -> None:
    wall = rectangle(0, 10.0, 0.0, 10.0)
    # The scene begins where this does along x. Above it is a seventh of what is left of z.
    inner = diagonal([2.0, 0.0, 3.0], [10.0, 8.5, 9.0])
    tree = BuiltTree(np.concatenate([inner, wall]), **NOTHING_ELSE)
    planes = [
        (int(tree.axis[v.node]), float(tree.split[v.node]))
        for v in tree.walk()
        if not tree.is_leaf(v.node)
    ]
    assert planes == [(0, 10.0), (2, 3.0), (1, 8.5), (2, 9.0)]
    assert tree.report["empty_cell_splits"] == 3


def wall_in_a_box(position: float, wall: FloatArray) -> FloatArray:
    """Returns a wall {z = position} in the cell [0, 1]^3 that two triangles span."""
    return np.concatenate(
        [diagonal([0, 0, 0], [1, 1, 1]), diagonal([0, 0, 0], [1, 1, 1]), wall]
    ).astype(np.float32)


def below_root(tree: BuiltTree) -> list[set[int]]:
    """Returns what is referenced on the lower and the upper side of the root's plane."""

    def held(node: int) -> set[int]:
        if tree.is_leaf(node):
            return set(tree.referenced(node))
        child = int(tree.child[node])
        return held(child) | held(child + 1)

    return [held(int(tree.child[0]) + i) for i in range(2)]


@pytest.mark.parametrize(
    ("position", "smaller"), [(0.25, 0), (0.75, 1), (0.5, 0), (1.0, 1)]
)
def test_a_covered_plane_goes_to_the_smaller_side(position: float, smaller: int) -> None:
    triangles = wall_in_a_box(position, rectangle(2, position, 0.0, 1.0))
    options = {**NOTHING_ELSE, "rule_empty_cell": False}
    tree = BuiltTree(triangles, **options)
    # The wall then lies in a face of its cell, which cuts it off as a flat cell.
    assert tree.report["flat_cell_splits"] == (1 if position == 1.0 else 2)
    assert (tree.axis[0], tree.split[0]) == (2, position)
    sides = below_root(tree)
    assert {2, 3} <= sides[smaller]
    assert not {2, 3} & sides[1 - smaller]
    off = BuiltTree(triangles, rule_flat_cell=False, **options)
    assert off.report["flat_cell_splits"] == off.report["inner_nodes"] == 0


def test_a_wall_in_a_face_becomes_a_flat_cell() -> None:
    triangles = wall_in_a_box(0.0, rectangle(2, 0.0, 0.0, 1.0))
    tree = BuiltTree(triangles, rule_empty_cell=False, **NOTHING_ELSE)
    flat = [v for v in tree.walk() if tree.is_leaf(v.node) and v.lo[2] == v.hi[2]]
    assert len(flat) == 1
    assert tree.referenced(flat[0].node) == [2, 3]


@pytest.mark.parametrize("kind", ["half", "half twice", "half thrice", "small", "touching"])
def test_what_does_not_cover_is_no_flat_cell(kind: str) -> None:
    full = rectangle(2, 0.5, 0.0, 1.0)
    wall = {
        "half": full[:1],
        "half twice": np.repeat(full[:1], 2, axis=0),
        "half thrice": np.concatenate([full[:1], np.repeat(full[:1], 2, axis=0)]),
        "small": rectangle(2, 0.5, 0.0, 0.999),
        "touching": np.concatenate([full[:1], full[1:] + np.float32([0, 0, 2.0**-20])]),
    }[kind]
    tree = BuiltTree(wall_in_a_box(0.5, wall), rule_empty_cell=False, **NOTHING_ELSE)
    assert tree.report["flat_cell_splits"] == 0


def test_cover_by_overlapping_triangles_counts() -> None:
    full = rectangle(2, 0.5, 0.0, 1.0)
    wall = np.concatenate([full[:1], np.repeat(full[:1], 40, axis=0), full[1:]])
    tree = BuiltTree(wall_in_a_box(0.5, wall), rule_empty_cell=False, **NOTHING_ELSE)
    assert tree.report["flat_cell_splits"] == 2


def test_no_cell_below_the_area_floor_is_split() -> None:
    rng = np.random.default_rng(SEED)
    # All triangles share a point: cells about it keep them all, however small.
    triangles = np.concatenate(
        [np.zeros((200, 1, 3)), rng.normal(0, 1, (200, 2, 3))], axis=1
    ).astype(np.float32)
    floor = 1e-3

    def smallest(tree: BuiltTree) -> float:
        visits = list(tree.walk())
        scene = visits[0].area
        return min(v.area / scene for v in visits if not tree.is_leaf(v.node))

    with_floor = BuiltTree(triangles, intersection_cost=1.5, area_floor=floor)
    assert smallest(with_floor) >= floor
    assert with_floor.report["area_floor_leaves"] > 0
    below = [
        v
        for v in with_floor.walk()
        if with_floor.is_leaf(v.node)
        and with_floor.count[v.node]
        and v.area < floor * next(with_floor.walk()).area
    ]
    assert with_floor.report["area_floor_leaves"] == len(below)
    without = BuiltTree(triangles, intersection_cost=1.5, rule_area_floor=False)
    assert smallest(without) < floor
    assert without.report["area_floor_leaves"] == 0


def test_clipping_saves_references() -> None:
    vertices, faces = workloads.sphere(4)
    # In large leaves more depends on where cells cease to be split.
    clipped, not_clipped = (
        BuiltTree(vertices[faces], clip=c, intersection_cost=1.5) for c in (True, False)
    )
    assert clipped.report["references"] < not_clipped.report["references"]
    assert clipped.report["sah_cost"] < not_clipped.report["sah_cost"]
