"""Tiles of cameras that look along an axis need no special treatment."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
import workloads
from hard_cases.case import covers
from tracing import BRUTE_FORCE, build, closest, each_core, interval


@covers(9)
@each_core
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_no_tile_falls_back(core: ModuleType, axis: int) -> None:
    """Directions have zeros in the middle of the frame, but none along the camera's axis,
    so the beam of every tile can be judged."""
    scene = workloads.sphere(3)
    tree = build(core, scene)
    rays = workloads.camera(scene, axis, 65)
    expected = closest(tree, rays, BRUTE_FORCE)
    options = {"traversal": "packet", "entry_points": True, "initial_tile": 32}
    counters: dict[str, int] = {}
    t, face, *_ = tree.closest_hit(*rays, *interval(rays, 0, np.inf), options, counters)
    np.testing.assert_array_equal(face.view(np.int32), expected.face)
    np.testing.assert_array_equal(t, expected.t)
    assert counters["tiles"] > 4 and counters["fallbacks"] == 0
    # All tiles of rays to all sides do fall back.
    around = rays[0], workloads.snap(np.random.default_rng(1).normal(size=rays[1].shape))
    tree.closest_hit(*around, *interval(around, 0, np.inf), options, counters)
    assert counters["fallbacks"] > 0
