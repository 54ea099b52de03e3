"""Scaling by powers of two changes exponents only."""

from __future__ import annotations

import numpy as np
import pytest
import workloads
from hard_cases.case import SEED, covers
from hard_cases.running import WAYS
from kd_trees import BUILDERS, BuiltTree
from tracing import build, closest

from mlrt_plugin._dispatch import core


@covers(12)
@pytest.mark.parametrize("builder", BUILDERS)
@pytest.mark.parametrize("power", [-60, -40, -20, 30])
def test_hits_and_trees_are_scaled_exactly(builder: str, power: int) -> None:
    """Products of coordinates leave the range of single precision, and any constant in a
    comparison would show."""
    rng = np.random.default_rng(SEED)
    size = np.float32(2.0**power)
    for vertices, faces in (workloads.sphere(3), workloads.soup(rng, 150)):
        rays = workloads.into_box(rng, (vertices, faces), 300)
        at = workloads.at_vertices(rng, (vertices, faces), 300)
        shared = np.tile(np.float32([0.25, -3, 0.5]), (300, 1))
        origins = np.concatenate([rays[0], at[0], shared])
        directions = np.concatenate([rays[1], at[1], rng.choice(vertices, 300) - shared])
        tree = build(core, (vertices, faces), **BUILDERS[builder])
        expected = closest(tree, (origins, directions), WAYS["brute force"])
        assert (expected.face >= 0).mean() > 0.3
        for options in WAYS.values():
            scaled = build(core, (vertices * size, faces), **BUILDERS[builder])
            found = closest(scaled, (origins * size, directions), options)
            np.testing.assert_array_equal(found.face, expected.face)
            np.testing.assert_array_equal(found.t, expected.t * size)

        plain = BuiltTree(vertices[faces], **BUILDERS[builder])
        other = BuiltTree(vertices[faces] * size, **BUILDERS[builder])
        for name in ("axis", "child", "first_reference", "count", "references"):
            np.testing.assert_array_equal(getattr(plain, name), getattr(other, name))
        inner = plain.axis != 3
        assert inner.sum() > 10
        np.testing.assert_array_equal(plain.split[inner] * size, other.split[inner])
