"""Beams without extent, along one side or both, before more triangles than a beam takes
without a grid of its rays."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
import workloads
from tracing import (
    BRUTE_FORCE,
    ENTRY_POINTS,
    TRAVERSALS,
    build,
    closest,
    each_core,
    occluded,
)

SEED = 20261128
WAYS = (
    TRAVERSALS["beam_leaf"],
    TRAVERSALS["adaptive"],
    ENTRY_POINTS["beam_leaf"],
    ENTRY_POINTS["beam_leaf, large tiles"],
)


def dense_scenes(rng: np.random.Generator) -> list[workloads.Scene]:
    vertices, faces = workloads.soup(rng, 3, 1.0)
    return [
        workloads.sphere(4),
        (vertices, np.repeat(faces, 200, axis=0)),
        workloads.flat(rng, 500),
        workloads.slivers(rng, 500),
    ]


@each_core
@pytest.mark.parametrize("count", [1, 17, 200])
@pytest.mark.parametrize("size", [0.0, 2.0**-149, 2.0**-99, 0.3])
def test_rays_in_a_line_or_all_the_same(core: ModuleType, size: float, count: int) -> None:
    """Directions differ along one axis, or not at all, by slopes of any size."""
    rng = np.random.default_rng(SEED)
    hit = 0
    for scene in dense_scenes(rng):
        tree = build(core, scene)
        # The flat scene is seen along z.
        axis = rng.integers(3) if scene[0][:, 2].any() else 2
        # At the middle of a face, of which one scene has many copies.
        origin = scene[0][scene[1][0]].mean(axis=0)
        origin[axis] -= 3
        origins = np.tile(origin, (count, 1))
        same = np.zeros((count, 3), np.float32)
        same[:, axis] = 1
        row, point = same.copy(), same.copy()
        row[:, (axis + 1) % 3] = rng.uniform(-size, size, count)
        point[:, (axis + 2) % 3] = size
        for directions in (same, row, point):
            rays = origins, directions
            expected = closest(tree, rays, BRUTE_FORCE)
            hit += np.count_nonzero(expected.face >= 0)
            for options in WAYS:
                closest(tree, rays, options).assert_same(expected)
                found = occluded(tree, rays, options)
                np.testing.assert_array_equal(found, expected.face >= 0)
    assert hit > 2 * count
