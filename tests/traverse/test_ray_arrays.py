"""What closest_hit makes of arrays from Python: groups of rays, and weights of vertices."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
import workloads
from tracing import TRAVERSALS, Rays, build, closest, each_core, occluded

SEED = 20261129
COUNTS = (1, 2, 5, 6, 15, 16, 17, 21, 22, 47, 48, 333)
"""Of rays: packets that are whole and not, and rows whose values fill packets or not."""


def rays_to(vertices: np.ndarray, count: int, common: bool, seed: int) -> Rays:
    """Towards random points of a scene, some of them from one point."""
    rng = np.random.default_rng(seed)
    size = 1 if common else count
    origins = rng.uniform(-3, 3, (size, 3)).astype(np.float32)
    targets = vertices[rng.integers(len(vertices), size=count)]
    targets = targets + rng.normal(0, 0.1, (count, 3))
    directions = (targets - origins).astype(np.float32)
    return np.ascontiguousarray(np.broadcast_to(origins, directions.shape)), directions


@each_core
@pytest.mark.parametrize("common", [False, True])
def test_weights_are_those_of_single_rays(core: ModuleType, common: bool) -> None:
    """Bit for bit, and the point that they stand for is the hit."""
    rng = np.random.default_rng(SEED)
    vertices, faces = scene = workloads.soup(rng, 500, 0.4)
    tree = build(core, scene)
    found = missed = 0
    for count in COUNTS:
        origins, directions = rays = rays_to(vertices, count, common, SEED + count)
        hits = closest(tree, rays, {"traversal": "packet"})
        for i in range(count):
            if hits.face[i] < 0:
                missed += 1
                assert hits.u[i] == hits.v[i] == 0 and np.isinf(hits.t[i])
                continue
            found += 1
            corners = vertices[faces[hits.face[i]]]
            expected = core.mlrta_selftest.barycentrics(origins[i], directions[i], corners)
            assert (hits.u[i], hits.v[i]) == tuple(np.float32(expected))
            a, b, c = corners.astype(np.float64)
            point = a + hits.u[i] * (b - a) + hits.v[i] * (c - a)
            on_ray = origins[i] + float(hits.t[i]) * directions[i].astype(np.float64)
            np.testing.assert_allclose(point, on_ray, atol=1e-5)
    assert found > 300 and missed > 20


@each_core
def test_one_interval_for_all_is_that_of_each(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 500, 0.4)
    tree = build(core, (vertices, faces))
    one = [np.full(1, end, np.float32) for end in (0.75, 1.0)]
    for options in TRAVERSALS.values():
        for common in (False, True):
            rays = rays_to(vertices, 777, common, SEED)
            expected = closest(tree, rays, options, 0.75, 1.0)
            assert (expected.face >= 0).any() and (expected.face < 0).any()
            t, face, u, v = tree.closest_hit(*rays, *one, options)
            for mine, theirs in (
                (t, expected.t),
                (face, expected.face),
                (u, expected.u),
                (v, expected.v),
            ):
                np.testing.assert_array_equal(mine, theirs)
            np.testing.assert_array_equal(
                np.asarray(tree.any_hit(*rays, *one, options), bool),
                occluded(tree, rays, options, 0.75, 1.0),
            )


@each_core
def test_lengths_must_agree(core: ModuleType) -> None:
    tree = build(core, workloads.box())
    rays = rays_to(np.zeros((1, 3), np.float32), 3, True, SEED)
    ends = np.zeros(1, np.float32), np.ones(1, np.float32)
    with pytest.raises(ValueError, match="one value, or as many as there are rays"):
        tree.closest_hit(*rays, ends[0], np.ones(2, np.float32), {})
    with pytest.raises(ValueError, match="must have the same length"):
        tree.any_hit(rays[0], rays[1][:2], *ends, {})
    none = np.zeros((0, 3), np.float32)
    for empty in (ends, (np.zeros(0, np.float32),) * 2):
        assert all(len(each) == 0 for each in tree.closest_hit(none, none, *empty, {}))


@each_core
def test_a_ray_that_starts_elsewhere_is_noticed(core: ModuleType) -> None:
    """Wherever it is among rays that all start in one point; so is one that starts
    nowhere."""
    vertices, _ = scene = workloads.sphere()
    tree = build(core, scene)
    count = 70
    origins, directions = rays_to(vertices, count, True, SEED)
    for place in range(count):
        for start in (np.float32([0, 0, 0.25]), np.float32([np.nan, 0, 0])):
            mixed = origins.copy()
            mixed[place] = start
            hits = closest(tree, (mixed, directions), {"traversal": "beam_leaf"})
            alone = closest(
                tree,
                (mixed[place : place + 1], directions[place : place + 1]),
                {"traversal": "single"},
            )
            assert hits.face[place] == alone.face[0] and hits.t[place] == alone.t[0]
