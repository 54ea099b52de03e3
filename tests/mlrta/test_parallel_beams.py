"""Beams of rays with a common direction, as those to a directional light."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import BRUTE_FORCE, Options, build, closest, each_core, interval, occluded
from workloads import Rays

SEED = 20261128
BEAM_LEAF: Options = {"traversal": "beam_leaf"}
ADAPTIVE: Options = {"traversal": "adaptive"}
WAYS = pytest.mark.parametrize(
    "options", [BEAM_LEAF, ADAPTIVE], ids=["beam_leaf", "adaptive"]
)

Floats = npt.NDArray[np.float32]


def _rays_along(direction: Floats, origins: npt.NDArray[np.floating]) -> Rays:
    start = np.ascontiguousarray(origins, np.float32)
    return start, np.ascontiguousarray(np.broadcast_to(direction, start.shape), np.float32)


def _grid(rng: np.random.Generator, side: int) -> npt.NDArray[np.float64]:
    """Points of a jittered grid on a curved surface, square by square of 16."""
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    flat = np.stack([x, y], -1).reshape(side // 4, 4, side // 4, 4, 2)
    flat = flat.transpose(0, 2, 1, 3, 4).reshape(-1, 2) + rng.uniform(
        0, 1, (side * side, 2)
    )
    flat = flat / side - 0.5
    return np.concatenate([flat, 0.2 * np.sin(9 * flat[:, :1] + 4 * flat[:, 1:])], -1)


DIRECTIONS: dict[str, list[float]] = {
    "oblique": [0.3, -0.5, 0.8],
    "backward": [0.1, 0.2, -3.0],
    "along x": [1, 0, 0],
    "along -z": [0, 0, -2],
    "diagonal": [1, 1, 1],
    "nearly along y": [1e-7, -1, 1e-12],
}

NOISE: dict[str, Callable[[np.random.Generator, Floats], Floats]] = {
    "exactly parallel": lambda rng, d: d,
    # As directions come out that lead from points to others far away.
    "but for rounding": lambda rng, d: np.asarray(
        d * (1 + rng.uniform(-1, 1, d.shape) * 2.0**-23), np.float32
    ),
    "in other lengths": lambda rng, d: np.asarray(
        d * rng.uniform(0.1, 10, (len(d), 1)), np.float32
    ),
    "with strays": lambda rng, d: np.where(
        (np.arange(len(d)) % 37 == 5)[:, None], rng.normal(0, 1, d.shape), d
    ).astype(np.float32),
}


@each_core
@WAYS
@pytest.mark.parametrize("noise", NOISE)
@pytest.mark.parametrize("name", DIRECTIONS)
def test_parallel_rays_are_stopped_as_by_brute_force(
    core: ModuleType, options: Options, name: str, noise: str
) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 600, 0.2))
    direction = np.array(DIRECTIONS[name], np.float32)
    hits, beams = [], 0
    for scale in (1.0, 0.3, 0.05, 0.05):
        counters: dict[str, int] = {}
        place = rng.uniform(-0.3, 0.3, 3)
        origins, along = _rays_along(direction, scale * _grid(rng, 32) + place)
        rays = origins, NOISE[noise](rng, along)
        t_min = rng.choice(np.array([0, 0.1, -1], np.float32), len(origins))
        t_max = rng.choice(np.array([np.inf, 1, 0.3, 0.05], np.float32), len(origins))
        expected = occluded(tree, rays, BRUTE_FORCE, t_min=t_min, t_max=t_max)
        found = tree.any_hit(*rays, *interval(rays, t_min, t_max), options, counters)
        assert np.array_equal(np.asarray(found, bool), expected), SEED
        hits.append(expected.mean())
        beams += counters["beams"]
    assert 0.02 < np.mean(hits) < 0.98, SEED
    assert beams > 0 and counters["beams"] > 0


@each_core
@pytest.mark.parametrize("offset", [0.0, 1e4], ids=["at the centre", "far away"])
def test_no_parallel_ray_passes_between_triangles(core: ModuleType, offset: float) -> None:
    """Rays through vertices and middles of edges of closed meshes, from within."""
    vertices, faces = workloads.moved(workloads.sphere(4), offset)
    tree = build(core, (vertices, faces))
    edges = vertices[faces[:, [0, 1]]].mean(axis=1)
    targets = np.concatenate([vertices, edges.astype(np.float32)])
    for name, components in DIRECTIONS.items():
        direction = np.array(components, np.float32)
        # Half a radius off the surface, exactly but for one rounding.
        length = np.abs(direction).max()
        origins = (targets - np.float32(0.5 / length) * direction).astype(np.float32)
        inside = (
            np.linalg.norm(origins.astype(np.float64) - np.float64(offset), axis=1) < 0.9
        )
        rays = _rays_along(direction, origins[inside])
        counters: dict[str, int] = {}
        found = tree.any_hit(*rays, *interval(rays, 0, np.inf), BEAM_LEAF, counters)
        assert len(found) > 100, name
        assert np.all(np.asarray(found, bool)), name
        assert counters["beams"] > 0, name
        assert np.all(occluded(tree, rays, ADAPTIVE)), name


@each_core
@pytest.mark.parametrize("exponent", [-100, -48, -46, -44, -42, -38, -34, -32, -20, 30, 60])
def test_parallel_rays_at_any_scale(core: ModuleType, exponent: int) -> None:
    """Where areas underflow, and where nothing does; with ends just at the hits."""
    rng = np.random.default_rng(SEED)
    scale = np.float32(2.0**exponent)
    vertices, faces = workloads.soup(rng, 200, 0.2)
    tree = build(core, (vertices * scale, faces))
    origins = _grid(rng, 32).astype(np.float32)
    beams = 0
    for components in DIRECTIONS.values():
        rays = _rays_along(np.array(components, np.float32), origins * scale)
        t = closest(tree, rays, BRUTE_FORCE).t
        for t_max in (np.inf, t, np.nextafter(t, np.float32(0))):
            expected = occluded(tree, rays, BRUTE_FORCE, t_max=t_max)
            for options in (BEAM_LEAF, ADAPTIVE):
                found = occluded(tree, rays, options, t_max=t_max)
                assert np.array_equal(found, expected), (components, SEED)
        counters: dict[str, int] = {}
        tree.any_hit(*rays, *interval(rays, 0, np.inf), BEAM_LEAF, counters)
        beams += counters["beams"]
    # Coordinates are too large for bounds at the greatest scale.
    assert (beams > 0) == (exponent < 40)


@each_core
def test_parallel_rays_of_which_some_are_of_no_use(core: ModuleType) -> None:
    """Far away, not finite, or without a direction: also the one in the middle."""
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 200, 0.2))
    direction = np.array([0.1, -0.2, 1], np.float32)
    for shift in range(9):
        origins, directions = _rays_along(direction, _grid(rng, 32))
        origins[shift::7] -= np.float32(1000) * direction
        origins[3 + shift :: 50] = 3e38
        origins[4 + shift :: 50, shift % 3] = np.nan
        origins[7 + shift :: 50, shift % 3] = rng.choice([-np.inf, np.inf])
        directions[5 + shift :: 50, 2] = np.inf
        directions[6 + shift :: 50] = 0
        directions[8 + shift :: 50] *= np.float32(2.0**-90)
        if shift > 4:
            origins[128::256] = np.nan
        rays = origins, directions
        expected = occluded(tree, rays, BRUTE_FORCE)
        assert 0.05 < expected.mean() < 0.95, SEED
        for options in (BEAM_LEAF, ADAPTIVE):
            assert np.array_equal(occluded(tree, rays, options), expected), (shift, SEED)
    counters: dict[str, int] = {}
    tree.any_hit(*rays, *interval(rays, 0, np.inf), BEAM_LEAF, counters)
    assert counters["beams"] > 0


@each_core
def test_beams_are_made_of_rays_to_a_directional_light(core: ModuleType) -> None:
    """With directions as Mitsuba computes them, from points off a surface of any normal."""
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 300, 0.1))
    surface = _grid(rng, 64)
    sun = np.array([0.3, 0.2, 0.9]) / np.linalg.norm([0.3, 0.2, 0.9])
    radius = np.sqrt(3.0)
    target = (surface + 2 * radius * sun).astype(np.float32)
    off = 1e-4 * rng.normal(0, 1, (1, 3)) + 1e-5 * rng.normal(0, 1, surface.shape)
    origins = (surface + off).astype(np.float32)
    rays = origins, target - origins
    counters: dict[str, int] = {}
    found = tree.any_hit(*rays, *interval(rays, 0, 1 - 1e-4), ADAPTIVE, counters)
    assert np.array_equal(
        np.asarray(found, bool), occluded(tree, rays, BRUTE_FORCE, t_max=1 - 1e-4)
    ), SEED
    assert counters["beams"] > 0
    assert counters["traversal_steps"] < counters["beam_steps"]


@each_core
@pytest.mark.parametrize("offset", [0.0, 1e3], ids=["at the centre", "far away"])
def test_parallel_rays_at_vertices_and_edges(core: ModuleType, offset: float) -> None:
    """Rays through points that bounds must leave open, sorted so that beams are narrow."""
    rng = np.random.default_rng(SEED)
    tested = 0
    for name, scene in workloads.scenes(rng).items():
        vertices, faces = workloads.moved(scene, offset)
        tree = build(core, (vertices, faces))
        extent = np.ptp(vertices, axis=0).max()
        for components in DIRECTIONS.values():
            direction = np.array(components, np.float32)
            weights = rng.choice([0, 0, 0.5, 1], (600, 3))
            weights[weights.sum(axis=1) == 0] = 1
            weights /= weights.sum(axis=1, keepdims=True)
            corners = vertices[faces[rng.integers(0, len(faces), 600)]]
            targets = np.einsum("nk,nkj->nj", weights, corners)
            before = rng.choice([0, 1e-4, 0.5]) * extent / np.abs(direction).max()
            origins = (targets - before * direction).astype(np.float32)
            origins = origins[np.argsort(origins @ rng.normal(0, 1, 3))]
            origins, along = _rays_along(direction, origins)
            rays = origins, NOISE["but for rounding"](rng, along)
            counters: dict[str, int] = {}
            found = tree.any_hit(*rays, *interval(rays, 0, np.inf), BEAM_LEAF, counters)
            expected = occluded(tree, rays, BRUTE_FORCE)
            assert np.array_equal(np.asarray(found, bool), expected), (name, SEED)
            tested += counters["beams"]
    assert tested > 100
