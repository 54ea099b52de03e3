"""The exact hits of mlrt-bench are those of the tests' oracle, which knows other ways."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import oracles
import pytest
import workloads
from mlrt_compare.bench import exact_hits
from mlrt_compare.bench.exact_hits import ExactTriangles, rounded

SEED = 77


@pytest.mark.parametrize("name", sorted(workloads.scenes(np.random.default_rng(SEED))))
def test_same_hits_as_the_oracle(name: str) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.scenes(rng)[name]
    rays = workloads.all_rays(rng, (vertices, faces), 60)
    expected = oracles.Soup(vertices, faces).hits(*rays)
    found = ExactTriangles(vertices, faces).nearest(*rays)
    t = [np.float32(math.inf) if hit is None else hit.t for hit in expected]
    np.testing.assert_array_equal(found.t, t)
    pairs = [(i, face) for i, hit in enumerate(expected) if hit for face in hit.faces]
    assert sorted(zip(found.ray.tolist(), found.face.tolist(), strict=True)) == pairs
    lowest = [-1 if hit is None else hit.face for hit in expected]
    np.testing.assert_array_equal(found.lowest(), lowest)
    np.testing.assert_array_equal(found.includes(found.lowest()), found.is_hit())
    assert not found.includes(np.full(len(t), len(faces))).any()
    assert found.is_hit().any() and found.exact_pairs > 0


def test_rays_and_triangles_of_other_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    """In parts of a few pairs, and with coordinates whose products are no doubles."""
    monkeypatch.setattr(exact_hits, "PAIRS", 1000)
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.sphere(2)
    for power in (-120, -60, 60, 110):
        size = np.float32(2.0**power)
        origins, directions = workloads.at_vertices(rng, (vertices, faces), 200)
        scene = vertices * size, faces
        expected = oracles.Soup(*scene).hits(origins * size, directions)
        found = ExactTriangles(*scene).nearest(origins * size, directions)
        lowest = [-1 if hit is None else hit.face for hit in expected]
        np.testing.assert_array_equal(found.lowest(), lowest)
        assert found.is_hit().all()


def test_nothing_to_hit() -> None:
    rays = np.ones((3, 3), np.float32), np.ones((3, 3), np.float32)
    empty = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)
    assert (ExactTriangles(*empty).nearest(*rays).lowest() == -1).all()
    none = rays[0][:0], rays[1][:0]
    assert len(ExactTriangles(*workloads.box()).nearest(*none).t) == 0


def test_rounding() -> None:
    rng = np.random.default_rng(SEED)
    values = [
        # Middles between floats, and a hair beside them.
        *((2**25 + 2 * k + 1) * 2**60 + e for k in range(4) for e in (-1, 0, 1)),
        *(int(x) for x in rng.integers(1, 2**62, 500)),
    ]
    for power in (-300, -230, -150, -85, -62, 0, 40, 41, 60, 120):
        for above in values:
            for below in (1, -3, 2**40 + 1):
                expected = oracles.round_to_float32(
                    Fraction(above, below) * Fraction(2) ** power
                )
                assert rounded(above, below, power) == float(expected)
    assert rounded(0, 5, 3) == 0
