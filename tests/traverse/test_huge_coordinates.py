"""Coordinates whose differences are more than single precision holds."""

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

SEED = 20261130
WAYS = {**TRAVERSALS, "entry points": ENTRY_POINTS["default tiles"]}


def soup(rng: np.random.Generator, size: float) -> workloads.Scene:
    vertices, faces = workloads.soup(rng, 400)
    middle = vertices.mean(axis=0)
    return np.float32((vertices - middle) / np.abs(vertices - middle).max() * size), faces


@each_core
@pytest.mark.parametrize("name", WAYS)
@pytest.mark.parametrize("size", [1e37, 1e38, 3e38])
def test_hits_are_those_of_brute_force(core: ModuleType, name: str, size: float) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, soup(rng, size))
    for common in (False, True):
        origins = np.float32(rng.uniform(-size, size, (1 if common else 600, 3)))
        origins = np.ascontiguousarray(np.broadcast_to(origins, (600, 3)))
        targets = rng.uniform(-0.5 * size, 0.5 * size, (600, 3))
        lengths = rng.choice([1e-30, 1e-3, 1, 3], (600, 1))
        rays = origins, np.float32((targets / size - origins / size) * lengths)
        expected = closest(tree, rays, BRUTE_FORCE)
        assert np.count_nonzero(expected.face >= 0) > 30
        closest(tree, rays, WAYS[name]).assert_same(expected)
        np.testing.assert_array_equal(occluded(tree, rays, WAYS[name]), expected.face >= 0)


@each_core
@pytest.mark.parametrize("name", WAYS)
def test_origins_far_from_a_small_scene(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.sphere(3))
    directions = rng.normal(size=(400, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[::2] = np.eye(3)[rng.integers(3, size=200)]
    for common in (False, True):
        toward = np.broadcast_to(directions[:1], (400, 3)) if common else directions
        rays = (
            np.ascontiguousarray(np.float32(-3e38 * toward)),
            np.ascontiguousarray(np.float32(toward)),
        )
        expected = closest(tree, rays, BRUTE_FORCE)
        assert np.count_nonzero(expected.face >= 0) > 100
        closest(tree, rays, WAYS[name]).assert_same(expected)
