"""Distances that beams find are the floats nearest to the exact ones."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
from mlrt_compare.bench.exact_hits import exact_distances
from tracing import TRAVERSALS, build, closest, each_core

SEED = 20261128
TRIANGLES, RAYS = 48, 64

DoubleArray = npt.NDArray[np.float64]
Make = Callable[[np.random.Generator], DoubleArray]


def anyhow(rng: np.random.Generator) -> DoubleArray:
    """Seen from the origin, at distances from near to far."""
    middle = rng.normal(size=(TRIANGLES, 1, 3)) * 10 ** rng.uniform(
        -2, 3, (TRIANGLES, 1, 1)
    )
    size = np.linalg.norm(middle, axis=2, keepdims=True)
    return middle + size * rng.normal(size=(TRIANGLES, 3, 3)) * 0.2


def grazing(rng: np.random.Generator) -> DoubleArray:
    """In planes that almost hold the origin."""
    corners = anyhow(rng)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    height = np.einsum("ij,ij->i", normal, corners[:, 0]) * (
        1 - 10 ** rng.uniform(-7, -1, TRIANGLES)
    )
    return corners - (height[:, None] * normal)[:, None]


def slivers(rng: np.random.Generator) -> DoubleArray:
    corners = anyhow(rng)
    thin = 10 ** rng.uniform(-6, -2, (TRIANGLES, 1))
    corners[:, 2] = (
        corners[:, 0]
        + rng.uniform(size=(TRIANGLES, 1)) * (corners[:, 1] - corners[:, 0])
        + thin * (corners[:, 2] - corners[:, 0])
    )
    return corners


def walls(rng: np.random.Generator) -> DoubleArray:
    """Across an axis, at depths that lie in the middle between two floats."""
    corners = anyhow(rng)
    corners[:, :, 2] = 1 + 2.0**-23 * rng.integers(0, 2**20, (TRIANGLES, 1))
    return corners


@each_core
@pytest.mark.parametrize("scale", [2.0**-90, 1.0, 2.0**60], ids=["tiny", "usual", "huge"])
@pytest.mark.parametrize("make", [anyhow, grazing, slivers, walls])
def test_distances_are_the_nearest_floats(
    core: ModuleType, make: Make, scale: float
) -> None:
    rng = np.random.default_rng(SEED)
    origin = np.float32([0, 0, -scale * 2.0**-24])
    hit = 0
    for corners in (scale * make(rng)).astype(np.float32):
        weights = rng.dirichlet(np.ones(3), RAYS)
        directions = (weights @ corners.astype(np.float64) / scale).astype(np.float32)
        if make is walls:
            directions *= rng.choice(np.float32([1, 1.5, 2]), (RAYS, 1)) / directions[:, 2:]
        scene = corners, np.array([(0, 1, 2)], np.uint32)
        rays = np.broadcast_to(origin, (RAYS, 3)).copy(), directions
        found = closest(build(core, scene), rays, TRAVERSALS["beam_leaf"])
        there = found.face == 0
        exact = exact_distances(
            rays[0][there], directions[there], np.broadcast_to(corners, (RAYS, 3, 3))[there]
        )
        np.testing.assert_array_equal(found.t[there], exact, f"seed {SEED}")
        hit += int(there.sum())
    assert hit > TRIANGLES * RAYS / 4


@each_core
def test_distances_of_many_triangles_in_a_beam(core: ModuleType) -> None:
    """Planes are made several at once, and more than are kept: whichever triangle a ray
    hits, its distance is that of this triangle. In the second order neighbours have
    numbers that lie as far apart as there are places for planes."""
    rng = np.random.default_rng(SEED)
    side = 32
    x, y = np.meshgrid(np.linspace(-0.2, 0.2, side), np.linspace(-0.2, 0.2, side))
    directions = np.stack([x, y, np.ones_like(x)], axis=2).reshape(-1, 3)
    directions *= rng.uniform(0.5, 2, (side * side, 1))
    depth = 10 ** rng.uniform(-1, 2, (side * side, 1, 1))
    size = 0.4 / side * depth * np.linalg.norm(directions, axis=1)[:, None, None]
    corners = directions[:, None] * depth + size * rng.normal(size=(side * side, 3, 3))
    faces = np.arange(3 * side * side, dtype=np.uint32).reshape(-1, 3)
    rays = np.zeros((side * side, 3), np.float32), directions.astype(np.float32)
    even_first = np.r_[0 : side * side : 2, 1 : side * side : 2]
    for traversal, order in itertools.product(
        ("beam_leaf", "adaptive"), (np.arange(side * side), even_first)
    ):
        vertices = corners[order].astype(np.float32).reshape(-1, 3)
        found = closest(build(core, (vertices, faces)), rays, TRAVERSALS[traversal])
        there = found.face < len(faces)
        assert len(np.unique(found.face[there])) > 200, f"seed {SEED}"
        exact = exact_distances(
            rays[0][there], rays[1][there], vertices[faces[found.face[there]]]
        )
        np.testing.assert_array_equal(found.t[there], exact, f"seed {SEED}")
