"""Starting at entry points never changes a hit, whatever the tiles and the culling."""

from __future__ import annotations

from types import ModuleType

import drjit
import numpy as np
import pytest
import workloads
from tracing import (
    BRUTE_FORCE,
    CORES,
    ENTRY_POINTS,
    Options,
    build,
    closest,
    each_core,
    interval,
    occluded,
)

SEED = 90210
SCENES = sorted(workloads.scenes(np.random.default_rng(SEED)))
each_variant = pytest.mark.parametrize("options", ENTRY_POINTS.values(), ids=ENTRY_POINTS)


def morton(rays: workloads.Rays, resolution: int) -> workloads.Rays:
    """Returns the rays of an image in Morton order; resolution is a power of two."""
    y, x = np.divmod(np.arange(resolution * resolution), resolution)
    code = sum(
        ((x >> bit) & 1) << (2 * bit) | ((y >> bit) & 1) << (2 * bit + 1)
        for bit in range(resolution.bit_length())
    )
    order = np.argsort(code)
    return rays[0][order], rays[1][order]


def views(rng: np.random.Generator, scene: workloads.Scene) -> list[workloads.Rays]:
    """Images of a scene along each axis, from its middle, and from one of its vertices."""
    resolution = 32
    images = [workloads.camera(scene, axis, resolution) for axis in range(3)]
    origins, directions = workloads.camera(scene, 2, resolution)
    tilted = directions + np.array((0.4, -0.3, 0), np.float32)
    for origin in (scene[0].mean(axis=0), rng.choice(scene[0])):
        images.append((np.broadcast_to(origin, origins.shape).copy(), tilted))
    # Pixels on the symmetry planes: directions with components that are exactly zero.
    images.append((origins, directions - directions[resolution * 16 + 16] * (1, 1, 0)))
    return [morton((o, d.astype(np.float32)), resolution) for o, d in images]


@each_core
@pytest.mark.parametrize("name", SCENES)
def test_images_are_those_of_brute_force(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    tree = build(core, scene)
    hits = 0
    for rays in views(rng, scene):
        expected = closest(tree, rays, BRUTE_FORCE)
        hits += np.count_nonzero(expected.face >= 0)
        for options in ENTRY_POINTS.values():
            closest(tree, rays, options).assert_same(expected)
            np.testing.assert_array_equal(occluded(tree, rays, options), expected.face >= 0)
    assert hits > 0


@each_core
@pytest.mark.parametrize("name", SCENES)
def test_rays_without_common_origin(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    tree = build(core, scene)
    origins, directions = workloads.camera(scene, 1, 32)
    spread = workloads.snap(rng.uniform(-0.1, 0.1, origins.shape)) + origins
    lens = morton((spread, directions), 32)
    parallel = morton((origins + directions, np.broadcast_to(directions[0], (1024, 3))), 32)
    for rays in (lens, parallel, workloads.all_rays(rng, scene, 150)):
        rays = rays[0], np.ascontiguousarray(rays[1])
        expected = closest(tree, rays, BRUTE_FORCE)
        for options in ENTRY_POINTS.values():
            closest(tree, rays, options).assert_same(expected)
            np.testing.assert_array_equal(occluded(tree, rays, options), expected.face >= 0)


@each_core
@each_variant
def test_shadow_rays_from_a_light_end_at_their_target(
    core: ModuleType, options: Options
) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 300)
    tree = build(core, scene)
    camera = views(rng, scene)[0]
    seen = closest(tree, camera, BRUTE_FORCE)
    t = np.where(seen.face < 0, np.float32(1), seen.t)[:, None]
    targets = camera[0] + t * camera[1]
    light = np.array((0.25, 1.5, -0.5), np.float32)
    origins = np.broadcast_to(light, targets.shape).copy()
    rays = origins, targets - origins
    # Rays that need no shadow are inactive.
    t_max = np.where(seen.face < 0, np.float32(0), np.float32(1 - 2.0**-10))
    expected = occluded(tree, rays, BRUTE_FORCE, 0, t_max)
    assert 0.1 < expected.mean() < 0.9
    np.testing.assert_array_equal(occluded(tree, rays, options, 0, t_max), expected)


@each_core
@each_variant
def test_intervals_cut_beams(core: ModuleType, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    for scene in (workloads.soup(rng, 200), workloads.stairs(), workloads.flat(rng)):
        tree = build(core, scene)
        for rays in views(rng, scene)[:4]:
            first = closest(tree, rays, BRUTE_FORCE)
            t = np.where(first.face < 0, np.float32(1), first.t)
            part = (t * rng.uniform(0, 2, t.shape)).astype(np.float32)
            for t_min, t_max in ((t, np.inf), (0, t), (part, np.inf), (0, part)):
                expected = closest(tree, rays, BRUTE_FORCE, t_min, t_max)
                closest(tree, rays, options, t_min, t_max).assert_same(expected)
                hit = occluded(tree, rays, options, t_min, t_max)
                np.testing.assert_array_equal(hit, expected.face >= 0)


@each_core
@each_variant
def test_beams_may_end_where_a_distance_was_rounded_to(
    core: ModuleType, options: Options
) -> None:
    """A surface whose exact distance exceeds t_max, but whose rounded one does not."""
    vertices = np.array([(-1, -1, 1), (3, -1, 1), (-1, 3, 1)], np.float32)
    tree = build(core, (vertices, np.array([(0, 1, 2)], np.uint32)))
    rounded_down = 0
    for length in range(3, 100, 2):
        directions = np.full((16, 3), (0.25 * length, 0.5 * length, length), np.float32)
        rays = np.zeros_like(directions), directions
        t_max = np.float32(1 / length)
        rounded_down += float(t_max) * length < 1
        assert (closest(tree, rays, options, 0, t_max).t == t_max).all(), length
        assert occluded(tree, rays, options, 0, t_max).all(), length
    assert rounded_down > 10


@each_core
@pytest.mark.parametrize("count", [1, 15, 16, 17, 40, 100, 255, 257])
@pytest.mark.parametrize("split_factor", [4, 16])
@pytest.mark.parametrize("tiles", [(1, 1), (3, 1), (8, 1), (16, 2), (5, 3), (16, 5)])
def test_tiles_of_any_size_hold_all_rays_once(
    core: ModuleType, count: int, split_factor: int, tiles: tuple[int, int]
) -> None:
    scene = workloads.box()
    tree = build(core, scene)
    directions = np.ascontiguousarray(workloads.camera(scene, 0, 17)[1][:count])
    rays = np.full_like(directions, 0.125), directions
    options = {"initial_tile": tiles[0], "minimum_tile": tiles[1]}
    options["split_factor"] = split_factor
    counters: dict[str, int] = {}
    ends = interval(rays, 0, np.inf)
    face = tree.closest_hit(*rays, *ends, options, counters)[1]
    np.testing.assert_array_equal(face, closest(tree, rays, BRUTE_FORCE).face)
    assert counters["rays"] == count
    assert counters["tiles"] >= -(-count // tiles[0] ** 2)


@each_core
@each_variant
def test_bad_rays_do_not_spoil_their_beam(core: ModuleType, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.sphere(2)
    tree = build(core, scene)
    origins, directions = views(rng, scene)[0]
    good = closest(tree, (origins, directions), options)
    directions = directions.copy()
    kind = rng.integers(0, 20, len(directions))
    for number, value in enumerate((np.nan, np.inf, -np.inf, 0)):
        directions[kind == number] = value
    bad = kind < 4
    found = closest(tree, (origins, directions), options)
    assert (found.face[bad] == -1).all()
    np.testing.assert_array_equal(found.face[~bad], good.face[~bad])
    np.testing.assert_array_equal(found.t[~bad], good.t[~bad])


@pytest.mark.skipif(len(CORES) < 2, reason="one instruction set only runs here")
@each_variant
def test_instruction_sets_agree(options: Options) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 200)
    for rays in views(rng, scene):
        first, *others = (closest(build(core, scene), rays, options) for core in CORES)
        for other in others:
            other.assert_same(first)


@each_core
def test_number_of_threads_does_not_matter(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 200)
    tree = build(core, scene)
    rays = workloads.camera(scene, 0, 96)
    options = ENTRY_POINTS["small tiles"]
    before = drjit.thread_count()
    found = []
    try:
        for threads in (1, 2, 5):
            drjit.set_thread_count(threads)
            found.append(closest(tree, rays, options))
    finally:
        drjit.set_thread_count(before)
    for hits in found:
        hits.assert_same(closest(tree, rays, BRUTE_FORCE))
