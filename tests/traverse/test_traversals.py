"""Traversals of the tree return the hits of brute force, bit for bit."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
import workloads
from tracing import (
    BRUTE_FORCE,
    CORES,
    TRAVERSALS,
    Options,
    build,
    closest,
    each_core,
    occluded,
)

SEED = 31337
SCENES = sorted(workloads.scenes(np.random.default_rng(SEED)))
each_traversal = pytest.mark.parametrize("options", TRAVERSALS.values(), ids=TRAVERSALS)


@each_core
@pytest.mark.parametrize("name", SCENES)
def test_same_hits_as_brute_force(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    tree = build(core, scene)
    rays = workloads.all_rays(rng, scene, 400)
    expected = closest(tree, rays, BRUTE_FORCE)
    assert (expected.face >= 0).any()
    for options in TRAVERSALS.values():
        closest(tree, rays, options).assert_same(expected)
        np.testing.assert_array_equal(occluded(tree, rays, options), expected.face >= 0)


@each_core
@each_traversal
def test_same_hits_within_intervals(core: ModuleType, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    for name, scene in workloads.scenes(rng).items():
        tree = build(core, scene)
        rays = workloads.all_rays(rng, scene, 60)
        first = closest(tree, rays, BRUTE_FORCE)
        t = np.where(first.face < 0, np.float32(1), first.t)
        infinity = np.full_like(t, np.inf)
        below = np.nextafter(t, np.float32(0))
        part = (t * rng.uniform(0, 2, t.shape)).astype(np.float32)
        for t_min, t_max in ((t, infinity), (0, t), (0, below), (below, t), (0, part)):
            expected = closest(tree, rays, BRUTE_FORCE, t_min, t_max)
            closest(tree, rays, options, t_min, t_max).assert_same(expected)
            hit = occluded(tree, rays, options, t_min, t_max)
            np.testing.assert_array_equal(hit, expected.face >= 0, err_msg=name)


@each_core
@each_traversal
def test_bad_and_inactive_rays_miss_and_leave_neighbours_alone(
    core: ModuleType, options: Options
) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.sphere(2)
    tree = build(core, scene)
    origins, directions = workloads.into_box(rng, scene, 1000)
    t_min = np.zeros(1000, np.float32)
    t_max = np.full(1000, np.inf, np.float32)
    good = closest(tree, (origins, directions), options)
    assert (good.face >= 0).mean() > 0.3

    kind = rng.integers(0, 12, 1000)
    axis = rng.integers(0, 3, 1000)
    row = np.arange(1000)
    for number, value in enumerate((np.nan, np.inf, -np.inf)):
        origins[row[kind == number], axis[kind == number]] = value
        directions[row[kind == number + 3], axis[kind == number + 3]] = value
    directions[kind == 6] = 0
    t_max[kind == 7] = 0
    t_max[kind == 8] = -1
    t_min[kind == 9] = np.inf
    bad = kind < 10
    found = closest(tree, (origins, directions), options, t_min, t_max)
    assert (found.face[bad] == -1).all() and (found.t[bad] == np.inf).all()
    np.testing.assert_array_equal(found.face[~bad], good.face[~bad])
    np.testing.assert_array_equal(found.t[~bad], good.t[~bad])
    hit = occluded(tree, (origins, directions), options, t_min, t_max)
    np.testing.assert_array_equal(hit, np.where(bad, False, good.face >= 0))


@each_core
@pytest.mark.parametrize("bound", ["t_min", "t_max"])
def test_bounds_that_are_not_numbers_miss(core: ModuleType, bound: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.box()
    rays = workloads.into_box(rng, scene, 100)
    tree = build(core, scene)
    for options in (BRUTE_FORCE, *TRAVERSALS.values()):
        assert (closest(tree, rays, options, **{bound: np.nan}).face == -1).all()
        assert not occluded(tree, rays, options, **{bound: np.nan}).any()


@each_core
@each_traversal
def test_sign_of_zero_does_not_matter(core: ModuleType, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    for scene in (workloads.box(), workloads.stairs(), workloads.soup(rng, 200)):
        tree = build(core, scene)
        origins, directions = workloads.along_axes(rng, scene, 2000)
        plain = closest(tree, (origins + 0, directions + 0), options)
        zeros = np.where(
            rng.random(directions.shape) < 0.5, np.float32(0), np.float32(-0.0)
        )
        signed = np.where(directions == 0, zeros, directions)
        closest(tree, (origins, signed), options).assert_same(plain)


@each_core
def test_nothing_behind_the_origin_is_hit(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 200)
    tree = build(core, scene)
    spread = workloads.from_vertices(rng, scene, 200)
    for rays in (spread, (np.zeros_like(spread[0]), spread[1])):
        for options in (BRUTE_FORCE, *TRAVERSALS.values()):
            ahead = closest(tree, rays, options)
            assert (ahead.face >= 0).any() and (ahead.face < 0).any()
            for t_min in (-0.0, -1.0, -np.inf):
                closest(tree, rays, options, t_min).assert_same(ahead)
                hit = occluded(tree, rays, options, t_min)
                np.testing.assert_array_equal(hit, ahead.face >= 0)
            assert (closest(tree, rays, options, -2.0, -1.0).face == -1).all()


@each_core
@each_traversal
@pytest.mark.parametrize("common_origin", [False, True])
@pytest.mark.parametrize("powers", [(-136, -136, -136), (0, -132, 0), (-132, -132, 0)])
def test_scenes_of_the_size_of_denormal_numbers(
    core: ModuleType, options: Options, common_origin: bool, powers: tuple[int, int, int]
) -> None:
    """Parameters of planes, or reciprocals of directions, are of little use there."""
    rng = np.random.default_rng(SEED)
    size = np.float32(2.0 ** np.array(powers))
    stretch = np.where(np.array(powers) == min(powers), size, np.float32(1))
    if len(set(powers)) == 1:
        stretch = np.full(3, 0.7, np.float32)
    for vertices, faces in (workloads.sphere(2), workloads.stairs()):
        tree = build(core, (vertices * size, faces))
        origins, directions = workloads.into_box(rng, (vertices, faces), 600)
        if common_origin:
            origins[:] = origins[0]
            directions = rng.choice(vertices, 600) - origins
        rays = origins * size, directions * stretch
        expected = closest(tree, rays, BRUTE_FORCE)
        assert (expected.face >= 0).mean() > 0.1
        closest(tree, rays, options).assert_same(expected)


@each_core
@each_traversal
@pytest.mark.parametrize("count", [0, 1, 2, 7, 8, 9, 15, 16, 17, 33])
def test_any_number_of_rays(core: ModuleType, options: Options, count: int) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 100, 0.6)
    tree = build(core, scene)
    rays = workloads.into_box(rng, scene, count)
    found = closest(tree, rays, options)
    assert found.t.shape == (count,)
    found.assert_same(closest(tree, rays, BRUTE_FORCE))


@each_core
@each_traversal
def test_scenes_without_anything_to_hit(core: ModuleType, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    rays = workloads.into_box(rng, workloads.box(), 50)
    corner = np.array([(0, 0, 0), (1, 0, 0), (0, np.nan, 1)], np.float32)
    empty = corner[:0], np.zeros((0, 3), np.uint32)
    point = corner, np.array([(0, 0, 0)], np.uint32)
    line = corner, np.array([(0, 1, 1)], np.uint32)
    undefined = corner, np.array([(0, 1, 2)], np.uint32)
    for scene in (empty, point, line, undefined):
        tree = build(core, scene)
        assert (closest(tree, rays, options).face == -1).all()
        assert not occluded(tree, rays, options).any()


@each_core
@each_traversal
def test_copies_of_one_triangle_give_the_lowest_face(
    core: ModuleType, options: Options
) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 3, 1.0)
    scene = vertices, np.repeat(faces[[2, 0, 1]], 300, axis=0)
    rays = workloads.into_box(rng, scene, 500)
    found = closest(build(core, scene), rays, options)
    assert set(np.unique(found.face)) <= {-1, 0, 300, 600}
    assert (found.face >= 0).any()


@each_core
@each_traversal
def test_order_of_faces_changes_numbers_only(core: ModuleType, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 300)
    rays = workloads.all_rays(rng, (vertices, faces), 200)
    plain = closest(build(core, (vertices, faces)), rays, options)
    order = rng.permutation(len(faces))
    shuffled = closest(build(core, (vertices, faces[order])), rays, options)
    np.testing.assert_array_equal(shuffled.t, plain.t)
    # Random triangles tie at shared vertices of a ray's origin only, and those are not hit.
    face = np.where(shuffled.face < 0, -1, order[shuffled.face])
    np.testing.assert_array_equal(face, plain.face)


@each_core
@pytest.mark.parametrize(
    "rules",
    [
        {"clip": False},
        {"rule_empty_cell": False},
        {"rule_flat_cell": False},
        {"rule_area_floor": False},
        {"max_depth": 1},
    ],
    ids=lambda rules: ", ".join(rules),
)
def test_the_shape_of_the_tree_does_not_matter(
    core: ModuleType, rules: dict[str, bool | int]
) -> None:
    rng = np.random.default_rng(SEED)
    for scene in (workloads.stairs(), workloads.duplicates(rng), workloads.soup(rng, 150)):
        rays = workloads.all_rays(rng, scene, 200)
        tree = build(core, scene, **rules)
        expected = closest(tree, rays, BRUTE_FORCE)
        for options in TRAVERSALS.values():
            closest(tree, rays, options).assert_same(expected)


@pytest.mark.skipif(len(CORES) < 2, reason="one instruction set only runs here")
def test_instruction_sets_agree() -> None:
    rng = np.random.default_rng(SEED)
    for scene in workloads.scenes(rng).values():
        rays = workloads.all_rays(rng, scene, 100)
        for options in (BRUTE_FORCE, *TRAVERSALS.values()):
            first, *others = (closest(build(core, scene), rays, options) for core in CORES)
            for other in others:
                other.assert_same(first)
