"""Every leaf references the triangles that overlap it, and the leaves are all of the scene.

A triangle overlaps a leaf if it meets the interior of the leaf's box. All is decided in
fractions, from the planes of the tree and the corners of the triangles alone.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator
from fractions import Fraction
from typing import Any

import exact_geometry as exact
import hypothesis.extra.numpy as arrays
import hypothesis.strategies as st
import numpy as np
import numpy.typing as npt
import pytest
import workloads
from hypothesis import given, settings
from kd_trees import BUILDERS, BuiltTree, Visit, each_builder

SEED = 20260211
FloatArray = npt.NDArray[np.float32]
TRIANGLES_OF_LARGE_SCENES = 80
LEAVES_OF_LARGE_SCENES = 150


def corners_of(scene: workloads.Scene) -> FloatArray:
    vertices, faces = scene
    return vertices[faces]


def lattice(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns triangles on a coarse grid, a third of them in planes across an axis."""
    triangles = rng.integers(0, 5, (count, 3, 3)).astype(np.float32)
    for i in range(0, count, 3):
        triangles[i, :, i % 9 // 3] = triangles[i, 0, i % 9 // 3]
    return triangles


def walls(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns rectangles across the axes, which make flat cells, among a few others."""
    faces = []
    for _ in range(count):
        axis = int(rng.integers(3))
        lo, hi = np.sort(rng.integers(0, 9, (2, 3)), axis=0) + np.array([[0], [1]])
        corners = np.full((4, 3), rng.integers(0, 10))
        corners[:, (axis + 1) % 3] = [lo[0], hi[0], hi[0], lo[0]]
        corners[:, (axis + 2) % 3] = [lo[1], lo[1], hi[1], hi[1]]
        faces.append(corners[[[0, 1, 2], [0, 2, 3]]])
    outer = [[[0, 0, z], [10, 0, z], [10, 10, z]] for z in (0, 10, 0, 10)]
    outer[2:] = [[[0, 0, z], [10, 10, z], [0, 10, z]] for z in (0, 10)]
    slanted = rng.uniform(0, 10, (count // 2, 3, 3))
    return np.concatenate([*faces, np.array(outer), slanted]).astype(np.float32)


def rosette(rng: np.random.Generator, count: int) -> FloatArray:
    """Returns triangles that share a point."""
    triangles = rng.uniform(-1, 1, (count, 3, 3)).astype(np.float32)
    triangles[:, 0] = 0.25
    return triangles


SCENES: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "soup": lambda rng: corners_of(workloads.soup(rng, 80)),
    "dense soup": lambda rng: corners_of(workloads.soup(rng, 30, 1.5)),
    "lattice": lambda rng: lattice(rng, 90),
    "lattice far out": lambda rng: lattice(rng, 90) + np.float32(1e6),
    "walls": lambda rng: walls(rng, 40),
    "box": lambda rng: corners_of(workloads.box()),
    "sphere": lambda rng: corners_of(workloads.sphere(2)),
    "far sphere": lambda rng: corners_of(workloads.moved(workloads.sphere(1), 1e6)),
    "stairs": lambda rng: corners_of(workloads.stairs(8)),
    "slivers": lambda rng: corners_of(workloads.slivers(rng, 60)),
    "fan": lambda rng: corners_of(workloads.fan(60)),
    "rosette": lambda rng: rosette(rng, 60),
    "flat": lambda rng: corners_of(workloads.flat(rng, 60)),
    "duplicates": lambda rng: corners_of(workloads.duplicates(rng, 60)),
    "tiny": lambda rng: lattice(rng, 60) * np.float32(1e-30),
    "denormal": lambda rng: lattice(rng, 60) * np.float32(2.0**-149),
    "huge": lambda rng: lattice(rng, 60) * np.float32(1e30),
}
LARGE_SCENES: dict[str, Callable[[np.random.Generator], FloatArray]] = {
    "soup": lambda rng: corners_of(workloads.soup(rng, 20_000, 0.05)),
    "sphere": lambda rng: corners_of(workloads.sphere(6)),
    "walls": lambda rng: walls(rng, 6_000) * np.float32(0.1),
    "slivers": lambda rng: corners_of(workloads.slivers(rng, 20_000)),
}
SWITCHES: list[dict[str, Any]] = [
    {},
    {"clip": False},
    {"rule_empty_cell": False, "rule_flat_cell": False, "intersection_cost": 8.0},
    {"rule_area_floor": False, "max_depth": 14},
]


class Leaves:
    """Leaves of a tree, with their boxes as arrays and in fractions."""

    def __init__(self, tree: BuiltTree, visits: list[Visit]) -> None:
        self.tree = tree
        self.visits = visits
        self.lo = np.array([v.lo for v in self.visits])
        self.hi = np.array([v.hi for v in self.visits])
        self.of_triangle: dict[int, set[int]] = {}
        for number, visit in enumerate(self.visits):
            for triangle in tree.referenced(visit.node):
                self.of_triangle.setdefault(triangle, set()).add(number)

    def box(self, number: int) -> tuple[exact.Point, exact.Point]:
        visit = self.visits[number]
        return exact.point(visit.lo), exact.point(visit.hi)

    def near(self, triangle: FloatArray) -> Iterator[int]:
        """The leaves whose interiors a triangle (3, 3) may meet.

        Left out are those that its bounds do not meet, for which no arithmetic is needed,
        and those on one side of its plane, by far more than double precision may err.
        """
        lo, hi = triangle.min(0), triangle.max(0)
        inside = (self.lo < hi) & (self.hi > lo)
        flat = (self.lo == self.hi) & (self.lo <= hi) & (self.hi >= lo)
        numbers = np.flatnonzero((inside | flat).all(axis=1))
        a, b, c = triangle.astype(np.float64)
        normal = np.cross(b - a, c - a)
        box = np.stack([self.lo[numbers], self.hi[numbers]]).astype(np.float64)
        distances = np.abs((box.mean(0) - a) @ normal)
        reach = (box[1] - box[0]) / 2 @ np.abs(normal)
        longest = np.abs(triangle.astype(np.float64)).max() + np.abs(box).max(initial=0)
        doubt = 1e-12 * longest * np.abs(b - a).max() * np.abs(c - a).max()
        return (int(i) for i in numbers[distances <= reach + doubt])

    def flat_axes(self, number: int) -> list[int]:
        return [k for k in range(3) if self.lo[number, k] == self.hi[number, k]]


def is_degenerate(triangle: FloatArray) -> bool:
    a, b, c = exact.polygon(triangle)
    u, v = ([q - p for p, q in zip(a, d, strict=True)] for d in (b, c))
    return all(u[i] * v[j] == u[j] * v[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def assert_no_leaf_lacks(leaves: Leaves, triangles: Iterable[int]) -> None:
    """Asserts that leaves reference what overlaps them.

    A leaf without an extent along an axis need not hold what crosses it or touches it:
    the points that they share lie in the closed boxes beside it too. Of what lies in its
    plane, each point must be in some leaf that holds it.
    """
    root = leaves.tree.lo, leaves.tree.hi
    for i in triangles:
        triangle = leaves.tree.triangles[i]
        corners = exact.polygon(triangle)
        holders = leaves.of_triangle.get(i, set())
        for number in leaves.near(triangle):
            if number in holders or not exact.overlaps(corners, *leaves.box(number)):
                continue
            where = (
                f"seed {SEED}: triangle {i} {triangle.tolist()}, {leaves.visits[number]}"
            )
            flat = [k for k in leaves.flat_axes(number) if root[0][k] < root[1][k]]
            assert flat, where
            if len(flat) == 1 and (triangle[:, flat] == leaves.lo[number, flat]).all():
                assert_covered(leaves, corners, number, flat[0], holders, where)


def assert_covered(
    leaves: Leaves,
    corners: exact.Polygon,
    number: int,
    axis: int,
    holders: set[int],
    where: str,
) -> None:
    """Asserts that the part of a triangle in a flat leaf lies in leaves that hold it."""

    def projected(part: exact.Polygon) -> exact.Polygon:
        return [tuple(c for k, c in enumerate(p) if k != axis) for p in part]

    part = exact.clip(corners, *leaves.box(number))
    pieces = [projected(exact.clip(part, *leaves.box(holder))) for holder in holders]
    assert exact.union_area(pieces) == exact.union_area([projected(part)]), where


def assert_all_is_there(tree: BuiltTree, leaves: Leaves) -> None:
    """Asserts that the leaves tile the root's box, and their references the array."""
    visits = list(tree.walk())
    assert sorted(v.node for v in visits) == list(range(len(tree.axis)))
    root_lo, root_hi = exact.point(tree.lo), exact.point(tree.hi)
    extended = [k for k in range(3) if root_lo[k] < root_hi[k]]

    def volume(visit: Visit) -> Fraction:
        product = Fraction(1)
        for k in extended:
            product *= Fraction(float(visit.hi[k])) - Fraction(float(visit.lo[k]))
        return product

    for visit in visits:
        assert (visit.lo <= visit.hi).all()
        if not tree.is_leaf(visit.node):
            axis, split = int(tree.axis[visit.node]), tree.split[visit.node]
            assert visit.lo[axis] <= split <= visit.hi[axis]
    assert sum(map(volume, leaves.visits)) == volume(visits[0])

    ranges = sorted(
        (int(tree.first_reference[v.node]), int(tree.count[v.node]))
        for v in leaves.visits
        if tree.count[v.node]
    )
    end = 0
    for first, count in ranges:
        assert first == end
        end += count
    assert end == len(tree.references)
    for visit in leaves.visits:
        held = tree.referenced(visit.node)
        assert held == sorted(set(held))
    used = sum(not is_degenerate(triangle) for triangle in tree.triangles)
    assert set(leaves.of_triangle) <= set(range(len(tree.triangles)))
    assert len(leaves.of_triangle) == used
    assert tree.report["dropped_triangles"] == len(tree.triangles) - used


@each_builder
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("options", SWITCHES, ids=lambda o: "-".join(o) or "default")
def test_leaves_hold_what_overlaps_them(
    builder: str, scene: str, options: dict[str, Any]
) -> None:
    triangles = SCENES[scene](np.random.default_rng(SEED))
    tree = BuiltTree(triangles, **BUILDERS[builder], **options)
    leaves = Leaves(tree, list(tree.leaves()))
    assert_all_is_there(tree, leaves)
    assert_no_leaf_lacks(leaves, leaves.of_triangle)


@pytest.mark.parametrize("builder", ["exact", "fast"])
@pytest.mark.parametrize("scene", LARGE_SCENES)
def test_leaves_of_large_scenes_hold_what_overlaps_them(builder: str, scene: str) -> None:
    """What a sample of the triangles overlaps, and what overlaps a sample of the leaves."""
    rng = np.random.default_rng(SEED)
    triangles = LARGE_SCENES[scene](rng)
    tree = BuiltTree(triangles, **BUILDERS[builder], intersection_cost=1.5)
    leaves = Leaves(tree, list(tree.leaves()))
    assert_all_is_there(tree, leaves)
    assert len(leaves.visits) > 3000
    sample = rng.choice(len(triangles), TRIANGLES_OF_LARGE_SCENES, replace=False)
    assert_no_leaf_lacks(leaves, (int(i) for i in sample))

    lo, hi = tree.triangles.min(axis=1), tree.triangles.max(axis=1)
    chosen = rng.choice(len(leaves.visits), LEAVES_OF_LARGE_SCENES, replace=False)
    solid = [i for i in chosen if not leaves.flat_axes(i)]
    sampled = Leaves(tree, [leaves.visits[i] for i in solid])
    touched = np.zeros(len(triangles), bool)
    for visit in sampled.visits:
        touched |= ((lo <= visit.hi) & (hi >= visit.lo)).all(axis=1)
    assert_no_leaf_lacks(sampled, np.flatnonzero(touched).tolist())


COORDINATES = st.one_of(
    st.integers(-3, 3).map(float),
    st.floats(-4, 4, width=32),
    st.sampled_from([1 / 3, 0.1, 1e-20, -1e-20, 2.0**-149, 1e6, 1e6 + 0.0625]).map(
        lambda x: float(np.float32(x))
    ),
)


@each_builder
@settings(max_examples=60, deadline=None, print_blob=True)
@given(
    triangles=st.integers(1, 14).flatmap(
        lambda n: arrays.arrays(np.float32, (n, 3, 3), elements=COORDINATES)
    ),
    options=st.fixed_dictionaries(
        {
            "clip": st.booleans(),
            "rule_empty_cell": st.booleans(),
            "rule_flat_cell": st.booleans(),
            "rule_area_floor": st.booleans(),
            "intersection_cost": st.sampled_from([0.5, 1.5, 20.0]),
            "max_depth": st.sampled_from([3, 10]),
        }
    ),
)
def test_leaves_hold_what_overlaps_them_whatever_the_triangles(
    builder: str, triangles: FloatArray, options: dict[str, Any]
) -> None:
    tree = BuiltTree(triangles, **BUILDERS[builder], **options)
    leaves = Leaves(tree, list(tree.leaves()))
    if len(tree.references):
        assert_all_is_there(tree, leaves)
        assert_no_leaf_lacks(leaves, leaves.of_triangle)
    else:
        assert all(is_degenerate(triangle) for triangle in triangles)


def test_overlapping_is_told_from_touching() -> None:
    triangle = exact.polygon([[0, 0, 0], [2, 0, 0], [0, 2, 0]])

    def box(lo: tuple[float, ...], hi: tuple[float, ...]) -> bool:
        return exact.overlaps(triangle, exact.point(lo), exact.point(hi))

    assert box((0, 0, -1), (1, 1, 1))
    assert not box((0, 0, 0), (1, 1, 1))
    assert box((0, 0, 0), (1, 1, 0))
    assert not box((1, 1, -1), (2, 2, 1))
    assert box((1, 0.875, -1), (2, 2, 1))
    for x, y in itertools.product((-1, 2), repeat=2):
        assert not box((x, y, -1), (x + 1, y + 1, 1))
