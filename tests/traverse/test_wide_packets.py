"""Packets with a common origin through the wide tree find what brute force does."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import (
    BRUTE_FORCE,
    Hits,
    Options,
    build,
    closest,
    each_core,
    interval,
    occluded,
)
from workloads import Rays, Scene

from mlrt_plugin.threads import thread_count

SEED = 20261130
SCENES = sorted(workloads.scenes(np.random.default_rng(SEED)))

WIDE: Options = {"traversal": "wide", "entry_points": False}
ADAPTIVE: Options = {"traversal": "adaptive"}


def in_order(directions: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Directions such that neighbours mostly are close to each other."""
    size = np.abs(directions).max(axis=1, keepdims=True)
    cells = np.floor(8 * directions / np.where(size > 0, size, 1))
    return np.ascontiguousarray(directions[np.lexsort(cells.T)])


def rays_from(
    rng: np.random.Generator, scene: Scene, origin: npt.NDArray[np.float32], count: int
) -> Rays:
    """At vertices, edges and points nearby, along axes, and strays."""
    vertices, faces = scene
    face = rng.choice(faces, count)
    weights = rng.choice([0, 0, 0.5, 0.25, 1], (count, 3))
    weights[weights.sum(axis=1) == 0] = (0, 1, 0)
    weights /= weights.sum(axis=1, keepdims=True)
    targets = (vertices[face].astype(np.float64) * weights[:, :, None]).sum(axis=1)
    directions = (targets.astype(np.float32) - origin).astype(np.float32)
    directions[rng.random((count, 3)) < 0.03] = 0
    directions[rng.random((count, 3)) < 0.01] = np.float32(-0.0)
    directions = in_order(directions)
    directions[::53] *= np.float32(2.0**-70)
    directions[7::59] = 0
    directions[11::61] = -directions[11::61]
    return np.tile(origin, (count, 1)), directions


def assert_same_hits(
    tree: Any, rays: Rays, t_min: npt.ArrayLike, t_max: npt.ArrayLike
) -> int:
    """Returns how many rays hit something."""
    expected = closest(tree, rays, BRUTE_FORCE, t_min, t_max)
    for options in (WIDE, ADAPTIVE):
        closest(tree, rays, options, t_min, t_max).assert_same(expected)
        hit = occluded(tree, rays, options, t_min, t_max)
        np.testing.assert_array_equal(hit, expected.face >= 0, f"seed {SEED}")
    return int((expected.face >= 0).sum())


def assert_brute_force(
    rng: np.random.Generator, core: ModuleType, scene: Scene, count: int
) -> int:
    """Returns how many rays hit something."""
    tree = build(core, scene)
    tree.widen()
    vertices = scene[0]
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    outside = (high + (high - low).max() * np.float32([0.3, 0.8, 1.5])).astype(np.float32)
    on_plane = vertices[0].copy()
    on_plane[0] = outside[0]
    found = 0
    for origin in (outside, on_plane, vertices[-1], ((low + high) / 2).astype(np.float32)):
        rays = rays_from(rng, scene, origin, count)
        first = closest(tree, rays, BRUTE_FORCE)
        t = np.where(first.face < 0, np.float32(1), first.t)
        below = np.nextafter(t, np.float32(0))
        for t_min, t_max in ((0, np.inf), (0, t), (0, below), (t, np.inf), (below, t)):
            found += assert_same_hits(tree, rays, t_min, t_max)
    return found


@each_core
@pytest.mark.parametrize("name", SCENES)
def test_same_hits_as_brute_force(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    assert assert_brute_force(rng, core, scene, 250) > 100, SEED


@each_core
@pytest.mark.parametrize("power", [-120, -70, -40, 30, 60, 100])
def test_same_hits_in_huge_and_tiny_scenes(core: ModuleType, power: int) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 200, 0.4)
    scene = (vertices * np.float32(2.0**power)).astype(np.float32), faces
    assert assert_brute_force(rng, core, scene, 200) > 100, SEED


@each_core
@pytest.mark.parametrize("exponent", [45, 60])
def test_ends_that_are_the_smallest_number(core: ModuleType, exponent: int) -> None:
    """Distances up to 1.5 times the smallest number round to it, and hits there count."""
    smallest = 2.0**-149
    directions = np.tile(np.float32([0, 0, 2.0**exponent]), (32, 1))
    directions[:, 0] = np.linspace(0, 1e-3, 32) * 2.0**exponent
    rays = np.zeros_like(directions), directions
    for share, stops in ((0.75, True), (1.25, True), (1.45, True), (1.75, False)):
        sheet = np.float64([[-1, -1, share], [2, -1, share], [-1, 2, share]])
        vertices = (sheet * 2.0**exponent * smallest).astype(np.float32)
        tree = build(core, (vertices, np.array([[0, 1, 2]], np.uint32)))
        tree.widen()
        for options in (BRUTE_FORCE, WIDE, ADAPTIVE):
            hits = closest(tree, rays, options, 0, smallest)
            np.testing.assert_array_equal(hits.face == 0, stops, f"{options} {share}")
            found = occluded(tree, rays, options, 0, smallest)
            np.testing.assert_array_equal(found, stops, f"{options} {share}")


def layers(rng: np.random.Generator) -> Scene:
    """Copies of some triangles, a few roundings nearer or farther along the rays from the
    origin, in any order: which one is nearest cannot be told in single precision."""
    middle = rng.normal(size=(8, 1, 3)) * 10 ** rng.uniform(-2, 2, (8, 1, 1))
    size = np.linalg.norm(middle, axis=2, keepdims=True)
    corners = middle + size * rng.normal(size=(8, 3, 3)) * 0.2
    nearer = 1 + 2.0**-24 * rng.integers(-24, 25, (12, 8, 1, 1))
    copies = (corners * nearer).reshape(-1, 3, 3)
    vertices = rng.permutation(copies).reshape(-1, 3).astype(np.float32)
    return vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)


def nested(rng: np.random.Generator) -> Scene:
    """Triangles that shrink towards a corner, and many equal ones there: a deep tree and a
    large leaf."""
    shrunk = rng.uniform(0, 1, (240, 3, 3)) * 1.2 ** -np.arange(240.0)[:, None, None]
    corners = np.concatenate([shrunk, np.repeat(shrunk[120:121], 300, axis=0)])
    vertices = corners.reshape(-1, 3).astype(np.float32)
    return vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)


@each_core
@pytest.mark.parametrize("make", [layers, nested])
def test_same_hits_from_where_triangles_crowd(
    core: ModuleType, make: Callable[[np.random.Generator], Scene]
) -> None:
    rng = np.random.default_rng(SEED)
    for _ in range(4):
        scene = make(rng)
        tree = build(core, scene)
        tree.widen()
        rays = rays_from(rng, scene, np.zeros(3, np.float32), 300)
        rays[1][...] *= np.float32(2.0) ** rng.integers(-15, 16, (300, 1))
        first = closest(tree, rays, BRUTE_FORCE)
        assert (first.face >= 0).sum() > 100, SEED
        t = np.where(first.face < 0, np.float32(1), first.t)
        for t_min, t_max in ((0, np.inf), (t, np.inf), (0, t), (t * (1 - 2e-6), np.inf)):
            assert_same_hits(tree, rays, t_min, t_max)


def dense(rng: np.random.Generator) -> tuple[Scene, Rays]:
    """A wavy surface of 20000 triangles and a square of 64 x 64 rays from one point, in
    Morton order."""
    side = 101
    y, x = np.mgrid[0:side, 0:side] / (side - 1) - 0.5
    z = 4 + 0.02 * np.sin(40 * x) * np.cos(35 * y)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    vertices += rng.uniform(-1e-3, 1e-3, vertices.shape)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + side], axis=1)
    upper = np.stack([corner + 1, corner + side + 1, corner + side], axis=1)
    faces = np.concatenate([lower, upper]).astype(np.uint32)
    bits = np.arange(4096)
    column = sum((bits >> 2 * k & 1) << k for k in range(6))
    row = sum((bits >> 2 * k + 1 & 1) << k for k in range(6))
    directions = np.ones((4096, 3), np.float32)
    directions[:, 0] = (column - 31.7) / 64 * 0.2
    directions[:, 1] = (row - 31.3) / 64 * 0.2
    return (vertices.astype(np.float32), faces), (np.zeros_like(directions), directions)


@each_core
def test_neighbours_share_steps(core: ModuleType) -> None:
    """Rays that have their own origins go alone: those visit more nodes by far."""
    scene, rays = dense(np.random.default_rng(SEED))
    tree = build(core, scene)
    tree.widen()
    expected = closest(tree, rays, BRUTE_FORCE)
    assert (expected.face >= 0).all()
    closest(tree, rays, WIDE).assert_same(expected)

    def counted(some: Rays) -> dict[str, int]:
        counters: dict[str, int] = {}
        tree.closest_hit(*some, *interval(some, 0, np.inf), WIDE, counters)
        assert counters["rays"] == 4096
        return counters

    alone = rays[0].copy()
    alone[:, 2] = np.linspace(0, 1e-6, 4096)
    together, apart = counted(rays), counted((alone, rays[1]))
    assert 0 < 3 * together["traversal_steps"] < apart["traversal_steps"]
    # A ray tests about the same triangles either way.
    assert 0 < together["triangle_tests"] < 1.5 * apart["triangle_tests"]


@each_core
@pytest.mark.parametrize("threads", [1, 2, 8])
def test_same_hits_by_any_number_of_threads(core: ModuleType, threads: int) -> None:
    """Of many copies of the rays, so that there is something to do for each thread."""
    scene, rays = dense(np.random.default_rng(SEED))
    tree = build(core, scene)
    tree.widen()
    once = closest(tree, rays, BRUTE_FORCE)
    expected = Hits(*(np.tile(each, 8) for each in (once.t, once.face, once.u, once.v)))
    origins, directions = (np.tile(each, (8, 1)) for each in rays)
    with thread_count(threads):
        for options in (WIDE, ADAPTIVE):
            closest(tree, (origins, directions), options).assert_same(expected)
            hit = occluded(tree, (origins, directions), options)
            np.testing.assert_array_equal(hit, expected.face >= 0)


@each_core
def test_beams_are_not_tried_again_and_again_where_they_lose(core: ModuleType) -> None:
    """Some of a dense surface are given up, and the more of the others not tried."""
    scene, rays = dense(np.random.default_rng(SEED))
    tree = build(core, scene)
    tree.widen()
    expected = closest(tree, rays, BRUTE_FORCE)
    beams = fallbacks = 0
    for _ in range(12):
        counters: dict[str, int] = {}
        tree.closest_hit(*rays, *interval(rays, 0, np.inf), ADAPTIVE, counters)
        assert counters["rays"] == 4096
        beams += counters["beams"]
        fallbacks += counters["fallbacks"]
    assert 0 < 2 * beams < fallbacks
    closest(tree, rays, ADAPTIVE).assert_same(expected)
    np.testing.assert_array_equal(occluded(tree, rays, ADAPTIVE), expected.face >= 0)


def lattice() -> tuple[Scene, Rays]:
    """A layer of triangles with corners at integers, and 48 x 48 rays from an integer point
    to corners and middles of edges: all of them run in faces of boxes."""
    side = 33
    y, x = np.mgrid[0:side, 0:side]
    vertices = np.stack([x, y, 16 + (x * y) % 3], axis=-1).reshape(-1, 3)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    lower = np.stack([corner, corner + 1, corner + side], axis=1)
    upper = np.stack([corner + 1, corner + side + 1, corner + side], axis=1)
    steps = np.arange(48) / 2
    targets = np.stack(np.meshgrid(steps, steps, [16.0]), axis=-1).reshape(-1, 3)
    directions = targets - [16, 8, 0]
    # Squares of 4 x 4 neighbours.
    row, column = np.divmod(np.arange(len(directions)), 48)
    order = np.lexsort([column % 4, row % 4, column // 4, row // 4])
    origin = np.tile(np.float32([16, 8, 0]), (len(directions), 1))
    scene = vertices.astype(np.float32), np.concatenate([lower, upper]).astype(np.uint32)
    return scene, (origin, directions[order].astype(np.float32))


@each_core
@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", [-1, 1])
def test_same_hits_along_faces_of_boxes(core: ModuleType, axis: int, side: int) -> None:
    (vertices, faces), (origins, directions) = lattice()

    def turned(points: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
        return np.ascontiguousarray(np.roll(points, axis, axis=1) * np.float32(side))

    tree = build(core, (turned(vertices), faces))
    tree.widen()
    rays = turned(origins), turned(directions)
    assert assert_same_hits(tree, rays, 0, np.inf) > 1500
    first = closest(tree, rays, BRUTE_FORCE)
    t = np.where(first.face < 0, np.float32(1), first.t)
    assert_same_hits(tree, rays, 0, t)
    assert_same_hits(tree, rays, t, np.inf)
