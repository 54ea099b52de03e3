"""Geometry that breaks tracers is hit where exact arithmetic says, whatever the builder."""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import oracles
import pytest
import workloads
from kd_trees import BUILDERS, BuiltTree, each_builder
from tracing import BRUTE_FORCE, ENTRY_POINTS, TRAVERSALS
from workloads import Rays, Scene

from mlrt_plugin import KdTree, MlrtWarning

SEED = 20260213
EXACT_RAYS = 150
FloatArray = npt.NDArray[np.float32]

WAYS = {**TRAVERSALS, "entry points": ENTRY_POINTS["small tiles"]}


def assert_right(builder: str, scene: Scene, rays: Rays, **options: Any) -> KdTree:
    """Asserts that hits are the oracle's for some rays and brute force's for all."""
    tree = KdTree(*scene, **BUILDERS[builder], **options)
    expected = tree.closest_hit(*rays, **BRUTE_FORCE)
    for way in WAYS.values():
        hits = tree.closest_hit(*rays, **way)
        for mine, theirs in zip(hits, expected, strict=True):
            np.testing.assert_array_equal(mine, theirs)
        np.testing.assert_array_equal(tree.any_hit(*rays, **way), hits.primitive >= 0)
    chosen = np.linspace(0, len(rays[0]) - 1, EXACT_RAYS).astype(int)
    found = oracles.Soup(*scene).hits(rays[0][chosen], rays[1][chosen])
    for ray, hit in zip(chosen, found, strict=True):
        face, t = (-1, np.float32(np.inf)) if hit is None else (hit.face, hit.t)
        assert (expected.primitive[ray], expected.t[ray]) == (face, t), (
            f"seed {SEED}: ray {ray}, {rays[0][ray]} {rays[1][ray]}"
        )
    return tree


def soup(count: int) -> Scene:
    return workloads.soup(np.random.default_rng(SEED), count, 0.8)


def rays_for(scene: Scene, count: int = 60) -> Rays:
    return workloads.all_rays(np.random.default_rng(SEED), scene, count)


@each_builder
def test_nothing(builder: str) -> None:
    rays = rays_for(workloads.box())
    tree = KdTree(np.zeros((0, 3)), np.zeros((0, 3), np.int64), **BUILDERS[builder])
    assert (tree.closest_hit(*rays).primitive == -1).all()
    assert (tree.report["leaves"], tree.report["references"]) == (1, 0)


@each_builder
@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_triangles(builder: str, count: int) -> None:
    scene = soup(count)
    tree = assert_right(builder, scene, rays_for(scene))
    hit = np.unique(tree.closest_hit(*rays_for(scene)).primitive)
    assert hit.tolist() == [-1, *range(count)]


@each_builder
def test_nothing_but_degenerate_triangles(builder: str) -> None:
    vertices, faces = soup(300)
    faces[::3, 2] = faces[::3, 1]
    faces[1::3] = faces[1::3, :1]
    # On a line, but not on one that floating point would see as such.
    vertices[faces[2::3, 2]] = 3 * vertices[faces[2::3, 0]] - 2 * vertices[faces[2::3, 1]]
    tree = KdTree(vertices, faces, **BUILDERS[builder])
    assert tree.report["dropped_triangles"] == 300
    for way in (BRUTE_FORCE, *WAYS.values()):
        hits = tree.closest_hit(*rays_for((vertices, faces)), **way)
        assert (hits.primitive == -1).all()


@each_builder
def test_degenerate_triangles_harm_nobody(builder: str) -> None:
    vertices, faces = soup(300)
    faces[::3, 2] = faces[::3, 1]
    tree = assert_right(builder, (vertices, faces), rays_for((vertices, faces)))
    assert tree.report["dropped_triangles"] == 100


def wall(axis: int, count: int = 12) -> FloatArray:
    """A square of triangles in the plane {x[axis] = 0}."""
    steps = np.linspace(-1, 1, count + 1)
    corners = []
    for (a, b), (c, d) in itertools.product(itertools.pairwise(steps), repeat=2):
        corners += [[(a, c), (b, c), (b, d)], [(a, c), (b, d), (a, d)]]
    return np.insert(np.array(corners), axis, 0, axis=2).astype(np.float32)


@each_builder
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("others", [False, True])
def test_all_in_one_plane(builder: str, axis: int, others: bool) -> None:
    """With two triangles besides, the plane of the others becomes one of the tree."""
    triangles = wall(axis)
    if others:
        besides = np.array([[[-1, -1, -1], [1, 1, -1], [1, -1, 1]]], np.float32)
        triangles = np.concatenate([triangles, besides, -besides])
    scene = (
        triangles.reshape(-1, 3),
        np.arange(3 * len(triangles), dtype=np.uint32).reshape(-1, 3),
    )
    tree = BuiltTree(triangles, **BUILDERS[builder])
    splits = tree.split[tree.axis == axis]
    assert (0 in splits) == others
    origins, directions = rays_for(scene)
    # From the plane, in the plane, and along the axes at its vertices.
    rng = np.random.default_rng(SEED)
    inside, along = origins.copy(), directions.copy()
    inside[:, axis] = 0
    along[::2, axis] = 0
    straight = rng.choice(scene[0], len(origins)) - np.eye(3, dtype=np.float32)[axis]
    upright = np.tile(np.eye(3, dtype=np.float32)[axis], (len(origins), 1))
    rays = (
        np.concatenate([origins, inside, straight]),
        np.concatenate([directions, along, upright]),
    )
    assert_right(builder, scene, rays)
    hits = KdTree(*scene, **BUILDERS[builder]).closest_hit(straight, upright)
    assert (hits.primitive >= 0).all()


@each_builder
@pytest.mark.parametrize("flat", [False, True])
def test_a_hundred_thousand_times_the_same_triangle(builder: str, flat: bool) -> None:
    vertices, faces = soup(1)
    if flat:
        vertices[:, 1] = 0.5
    rays = rays_for((vertices, faces), 4)
    tree = KdTree(vertices, np.repeat(faces, 100_000, axis=0), **BUILDERS[builder])
    assert tree.report["references"] <= 8 * 100_000 + 65536
    expected = KdTree(vertices, faces).closest_hit(*rays, **BRUTE_FORCE)
    assert set(np.unique(expected.primitive)) == {-1, 0}
    for way in WAYS.values():
        for mine, theirs in zip(tree.closest_hit(*rays, **way), expected, strict=True):
            np.testing.assert_array_equal(mine, theirs)


@each_builder
def test_a_pile_beside_something_else(builder: str) -> None:
    vertices, faces = soup(200)
    pile = np.concatenate([np.repeat(faces[:1], 20_000, axis=0), faces[1:]])
    rays = rays_for((vertices, faces), 20)
    hits = KdTree(vertices, pile, **BUILDERS[builder]).closest_hit(*rays)
    expected = KdTree(vertices, faces).closest_hit(*rays, **BRUTE_FORCE)
    np.testing.assert_array_equal(hits.t, expected.t)
    numbers = np.where(
        expected.primitive > 0, expected.primitive + 19_999, expected.primitive
    )
    np.testing.assert_array_equal(hits.primitive, numbers)


@each_builder
@pytest.mark.parametrize("exponent", [-135, -100, 100, 125])
@pytest.mark.parametrize("kind", ["soup", "sphere", "stairs"])
def test_extreme_extents(builder: str, kind: str, exponent: int) -> None:
    """2^-100 and 2^100 are about 1e-30 and 1e30; the others are near the last numbers."""
    make: dict[str, Callable[[], Scene]] = {
        "soup": lambda: soup(60),
        "sphere": lambda: workloads.sphere(2),
        "stairs": lambda: workloads.stairs(6),
    }
    vertices, faces = make[kind]()
    size = np.float32(2.0**exponent)
    origins, directions = rays_for((vertices, faces), 20)
    # Neither the distances nor the origins may leave the range of single precision.
    length = np.abs(directions).max(axis=1)
    keep = (length > 0.125) & (length < 8) & (np.abs(origins).max(axis=1) < 7)
    rays = origins[keep] * size, directions[keep]
    tree = assert_right(builder, (vertices * size, faces), rays)
    hits = tree.closest_hit(*rays)
    assert (hits.primitive >= 0).mean() > 0.1
    if abs(exponent) == 100:
        usual = KdTree(vertices, faces, **BUILDERS[builder])
        expected = usual.closest_hit(origins[keep], directions[keep])
        np.testing.assert_array_equal(hits.primitive, expected.primitive)


@each_builder
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_what_is_not_finite_is_dropped_counted_and_warned_of(
    builder: str, value: float
) -> None:
    vertices, faces = soup(100)
    rays = rays_for((vertices, faces))
    broken = vertices.astype(np.float64)
    broken[[3, 100, 200], [0, 1, 2]] = value
    with pytest.warns(
        MlrtWarning, match="3 of 100 faces .* first of them face 1,"
    ) as caught:
        tree = KdTree(broken, faces, **BUILDERS[builder])
    assert len(caught) == 1
    assert tree.report["dropped_triangles"] == 3
    rest = np.delete(faces, [1, 33, 66], axis=0)
    expected = KdTree(vertices, rest).closest_hit(*rays, **BRUTE_FORCE)
    numbers = np.append(np.delete(np.arange(100), [1, 33, 66]), -1)
    for way in WAYS.values():
        hits = tree.closest_hit(*rays, **way)
        np.testing.assert_array_equal(hits.primitive, numbers[expected.primitive])
        np.testing.assert_array_equal(hits.t, expected.t)


@each_builder
def test_nothing_but_what_is_not_finite(builder: str) -> None:
    with pytest.warns(MlrtWarning, match="20 of 20 faces"):
        tree = KdTree(np.full((60, 3), np.nan), soup(20)[1], **BUILDERS[builder])
    assert (tree.closest_hit(*rays_for(soup(20))).primitive == -1).all()


@each_builder
@pytest.mark.parametrize("index", [-1, 60, 2**31, 2**32, 2**63 - 1])
def test_indices_out_of_range_are_refused(builder: str, index: int) -> None:
    vertices, faces = soup(20)
    wide = faces.astype(np.int64)
    wide[7, 2] = index
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ValueError, match=f"vertex {index}, but there are 60 vertices"):
            KdTree(vertices, wide, **BUILDERS[builder])
