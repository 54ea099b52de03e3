"""What may not matter at all: the floating-point environment, threads, how rays come."""

from __future__ import annotations

import itertools
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import workloads
from denormals import denormals_flushed
from hard_cases.case import SEED, covers
from hard_cases.running import WAYS
from kd_trees import BUILDERS
from tracing import build, closest, each_core

from mlrt_plugin import KdTree
from mlrt_plugin._dispatch import core
from mlrt_plugin.threads import thread_count


def small_scene() -> workloads.Scene:
    """A sphere of radius 2^-100 beside one of radius 2^-130, whose coordinates are
    denormal."""
    vertices, faces = workloads.sphere(2)
    tiny = vertices * np.float32(2.0**-130) + np.float32([0, 0, 2.0**-128])
    return (
        np.concatenate([vertices * np.float32(2.0**-100), tiny]).astype(np.float32),
        np.concatenate([faces, faces + np.uint32(len(vertices))]),
    )


@covers(38)
@pytest.mark.parametrize("builder", BUILDERS)
def test_flushing_denormal_numbers_changes_nothing(builder: str) -> None:
    """Dr.Jit's threads flush denormal numbers, Python's thread does not, and rays are
    traced by both."""
    rng = np.random.default_rng(SEED)
    vertices, faces = small_scene()
    origins = (rng.uniform(-0.3, 0.3, (400, 3)) * 2.0**-101).astype(np.float32)
    origins[::2] = origins[0]
    rays = origins, (rng.choice(vertices, 400) - origins) * np.float32(2.0**80)
    plain = build(core, (vertices, faces), **BUILDERS[builder])
    expected = closest(plain, rays, WAYS["brute force"])
    assert (expected.face >= 0).all()
    with thread_count(1):
        for options in WAYS.values():
            closest(plain, rays, options).assert_same(expected)
            with denormals_flushed():
                flushed = np.float32(2.0**-149) * np.ones(1, np.float32)
                tree = build(core, (vertices, faces), **BUILDERS[builder])
                found = closest(tree, rays, options)
            assert flushed[0] == 0, "denormal numbers were not flushed"
            found.assert_same(expected)


@covers(38)
@pytest.mark.parametrize("builder", BUILDERS)
def test_threads_and_numbers_of_rays_change_nothing(builder: str) -> None:
    """Which rays share a packet, a beam and a thread hangs on how many there are, and a
    lazy tree grows in another order."""
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 300)
    spread = workloads.all_rays(rng, scene, 150)
    camera = workloads.camera(scene, 2, 41)
    for rays in (spread, camera):
        expected = closest(build(core, scene), rays, WAYS["brute force"])
        for threads in (1, 2, 5):
            with thread_count(threads):
                for options in WAYS.values():
                    tree = build(core, scene, **BUILDERS[builder])
                    closest(tree, rays, options).assert_same(expected)
                    for first, count in ((0, 1), (3, 8), (7, 16), (5, 777)):
                        part = slice(first, first + count)
                        found = closest(tree, (rays[0][part], rays[1][part]), options)
                        np.testing.assert_array_equal(found.t, expected.t[part])
                        np.testing.assert_array_equal(found.face, expected.face[part])


@covers(38)
def test_places_of_nodes_change_nothing(tmp_path: Path) -> None:
    """Another layout visits the same cells at other addresses: nodes of a lazy tree lie in
    the order in which rays came, those of a file in that of the builder."""
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 400)
    origins, directions = workloads.all_rays(rng, (vertices, faces), 100)
    eager = KdTree(vertices, faces, builder="fast")
    file = tmp_path / "soup.kdtree"
    eager.save(file)
    trees = [KdTree.load(file, vertices, faces, builder="fast")]
    for order in (slice(None), slice(None, None, -1), slice(None, None, 7)):
        lazy = KdTree(vertices, faces, builder="lazy")
        lazy.closest_hit(
            np.ascontiguousarray(origins[order]), np.ascontiguousarray(directions[order])
        )
        trees.append(lazy)
    for options in WAYS.values():
        expected = eager.closest_hit(origins, directions, **options)
        assert (expected.primitive >= 0).mean() > 0.3
        for tree in trees:
            found = tree.closest_hit(origins, directions, **options)
            for mine, theirs in zip(found, expected, strict=True):
                np.testing.assert_array_equal(mine, theirs)


@covers(35)
@each_core
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_shells_around_the_camera_cover_what_is_outside_only(
    core: ModuleType, axis: int
) -> None:
    """A closed mesh is around all of the camera's rays, so that its triangles stop whole
    tiles; an inner one, with holes, stands before it, and an outer one must not be seen."""
    vertices, faces = workloads.box()
    halves = np.arange(len(faces)) % 2 > 0
    small, large = np.float32(0.5), np.float32(3)
    count = np.uint32(len(vertices))
    scene = (
        np.concatenate([vertices * large, vertices, vertices * small]),
        np.concatenate([faces, faces + count, faces[halves] + 2 * count]),
    )
    tree = build(core, scene)
    _, directions = workloads.camera(scene, axis, 64)
    rays = np.tile(np.float32([0.1, -0.2, 0.15]), (len(directions), 1)), directions
    expected = closest(tree, rays, WAYS["brute force"])
    assert (expected.face >= len(faces)).all()
    assert len(np.unique(expected.face >= 2 * len(faces))) == 2
    for covering, traversal, tile in itertools.product(
        (True, False), ("packet", "interval", "beam_leaf", "adaptive"), (16, 64)
    ):
        options = {
            "traversal": traversal,
            "entry_points": True,
            "initial_tile": tile,
            "minimum_tile": 4,
            "covering_triangles": covering,
        }
        closest(tree, rays, options).assert_same(expected)
