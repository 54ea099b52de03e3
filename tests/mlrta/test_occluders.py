"""Triangles that stop a beam: only if every ray hits them, and then hits stay the same."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any

import beams
import numpy as np
import numpy.typing as npt
import oracles
import pytest
import workloads
from tracing import BRUTE_FORCE, Options, build, closest, each_core, interval, occluded

SEED = 2718
Corners = tuple[tuple[float, float, float], ...]

SMALL_TILES: Options = {"initial_tile": 16, "minimum_tile": 4}
SHADOW_WAYS: tuple[Options, ...] = (
    {},
    SMALL_TILES,
    {**SMALL_TILES, "traversal": "packet"},
    {**SMALL_TILES, "traversal": "interval"},
)


def corners(vertices: npt.ArrayLike) -> Corners:
    rows = np.asarray(vertices, np.float32)
    return tuple((float(x), float(y), float(z)) for x, y, z in rows)


def distance(origin: Any, direction: Any, triangle: Corners) -> Fraction | None:
    """Returns the exact parameter at which a ray's line meets a triangle."""
    points = (oracles.to_point(p) for p in (origin, direction, *triangle))
    return oracles.meet(*points)


def assert_covered(bound: float, rays: workloads.Rays, triangle: Corners) -> float:
    """Asserts that rays hit a triangle no later than `bound`; returns the last distance."""
    last = Fraction(0)
    for origin, direction in zip(*rays, strict=True):
        t = distance(origin, direction, triangle)
        assert t is not None and t > 0, (SEED, origin, direction, triangle)
        assert np.float32(float(t)) <= bound, (SEED, origin, direction, triangle)
        last = max(last, t)
    return float(last)


@each_core
def test_covered_beams_of_rays(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    covered = hit_by_all = 0
    for _ in range(400):
        spread = float(rng.choice([0.001, 0.05, 0.3]))
        rays = beams.bundle(rng, 8, True, spread=spread)
        ends = np.zeros(8, np.float32), np.full(8, np.inf, np.float32)
        beam = core.mlrta_selftest.ray_beam(*rays, *ends, True)
        ahead = rays[0][0] + rng.uniform(-1, 3) * rays[1][0]
        for _ in range(6):
            size = rng.choice([0.1, 1, 4])
            triangle = corners(workloads.snap(ahead + size * rng.normal(size=(3, 3))))
            bound = core.mlrta_selftest.covered_until(beam, triangle)
            distances = [distance(*ray, triangle) for ray in zip(*rays, strict=True)]
            hit_by_all += all(t is not None and t > 0 for t in distances)
            if bound is not None:
                last = assert_covered(bound, rays, triangle)
                # Slopes of all rays are a little more than those of these eight.
                covered += bound < 1.2 * last or spread > 0.1
    assert covered > 0.6 * hit_by_all > 100


Film = tuple[float, float, float, float]
CAMERA = ((0.0, 0.0, 0.0), (-1.0, -1.0, 1.0), (0.125, 0.0, 0.0), (0.0, 0.125, 0.0))
"""Looks along z; film positions 0 to 16 are -1 to 1 on the plane z = 1."""


def beam_of(core: ModuleType, film: Film, t_max: float = np.inf, t_min: float = 0) -> Any:
    return core.mlrta_selftest.camera_beam(*CAMERA, *film, t_max, t_min)


@each_core
def test_covered_tiles_of_a_camera(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    covered = 0
    for _ in range(400):
        x, y = rng.integers(0, 15, 2)
        size = float(rng.choice([0.25, 1, 2]))
        film = float(x), float(x + size), float(y), float(y + size)
        positions = rng.choice([0, 0.5, 1, rng.random()], (12, 2)) * size + (x, y)
        px, py = np.float32(positions).T[:, :, None]
        _, base, dx, dy = (np.float32(row) for row in CAMERA)
        directions = (base + px * dx) + py * dy
        middle = directions.mean(axis=0) * rng.uniform(0.5, 4)
        reach = rng.choice([0.2, 0.5, 2])
        triangle = corners(workloads.snap(middle + reach * rng.normal(size=(3, 3))))
        bound = core.mlrta_selftest.covered_until(beam_of(core, film), triangle)
        if bound is not None:
            covered += 1
            assert_covered(bound, (np.zeros_like(directions), directions), triangle)
    assert covered > 25


@each_core
def test_edges_on_the_border_of_a_tile_do_not_cover_it(core: ModuleType) -> None:
    """Film x = 4 to 8 is -0.5 to 0 on the plane z = 1, where the triangle ends too."""
    for edge, expected in ((0.0, False), (2.0**-12, True), (-(2.0**-12), False)):
        triangle = corners([(edge, -8, 1), (edge, 8, 1), (-8, 0, 1)])
        for order in ((0, 1, 2), (2, 1, 0), (1, 2, 0)):
            turned = tuple(triangle[i] for i in order)
            beam = beam_of(core, (4, 8, 4, 8))
            bound = core.mlrta_selftest.covered_until(beam, turned)
            assert (bound is not None) == expected, edge
            assert bound is None or 1 <= bound < 1 + 2.0**-20


@each_core
def test_what_does_not_stop_all_rays(core: ModuleType) -> None:
    wall = corners([(-9, -9, 2), (9, -9, 2), (0, 9, 2)])
    behind = corners([(x, y, -z) for x, y, z in wall])
    covered_until = core.mlrta_selftest.covered_until
    film = (4, 12, 4, 12)
    assert covered_until(beam_of(core, film), wall) is not None
    assert covered_until(beam_of(core, film), behind) is None
    # Rays begin at the wall, or behind it.
    assert covered_until(beam_of(core, film, t_min=1.9375), wall) is not None
    for t_min in (2.0, 2.5, np.inf):
        assert covered_until(beam_of(core, film, t_min=t_min), wall) is None
    # Rays in the plane, and rays from all over the place.
    assert covered_until(beam_of(core, film), ((0, 0, 0), (9, 0, 9), (-9, 9, 9))) is None
    rays = beams.bundle(np.random.default_rng(SEED), 8, False, spread=0.01)
    ends = np.zeros(8, np.float32), np.full(8, np.inf, np.float32)
    beam = core.mlrta_selftest.ray_beam(*rays, *ends, False)
    ahead = rays[0][0] + rays[1][0]
    assert covered_until(beam, corners(ahead + 100 * np.float32(wall))) is None


@each_core
@pytest.mark.parametrize("swapped", [False, True])
def test_equal_distances_behind_a_covering_triangle(
    core: ModuleType, swapped: bool
) -> None:
    """Two walls whose distances differ, but round to the same float: the lower number."""
    distant = 2.0**24
    walls = [[(-z, -z, z), (z, -z, z), (0, 2 * z, z)] for z in (distant + 2, distant)]
    walls = walls[::-1] if swapped else walls
    vertices = np.array(walls, np.float32).reshape(-1, 3)
    vertices[:, 2] -= np.float32(distant)
    scene = vertices, np.arange(6, dtype=np.uint32).reshape(2, 3)
    grid = np.linspace(-0.25, 0.25, 16)
    directions = np.float32([(x, y, 1) for y in grid for x in grid])
    origins = np.broadcast_to(np.float32((0, 0, -distant + 1)), directions.shape).copy()
    tree = build(core, scene)
    counters: dict[str, int] = {}
    rays = origins, directions
    ends = interval(rays, 0, np.inf)
    t, face = tree.closest_hit(*rays, *ends, SMALL_TILES, counters)[:2]
    assert counters["blockers"] > 0
    expected = closest(tree, rays, BRUTE_FORCE)
    np.testing.assert_array_equal(face, expected.face)
    np.testing.assert_array_equal(t, expected.t)


@each_core
def test_camera_in_a_closed_room(core: ModuleType) -> None:
    """Its walls cover most tiles, and all is inside of a closed box."""
    rng = np.random.default_rng(SEED)
    room, faces = workloads.box()
    pieces, more = workloads.soup(rng, 40, 0.2)
    scene = np.concatenate([room * 4, pieces]), np.concatenate([faces, more + len(room)])
    tree = build(core, scene)
    for axis in range(3):
        directions = workloads.camera(scene, axis, 64)[1]
        rays = np.full_like(directions, 0.1875), directions
        expected = closest(tree, rays, BRUTE_FORCE)
        assert (expected.face >= 0).all()
        for covering in (True, False):
            options = {**SMALL_TILES, "covering_triangles": covering}
            counters: dict[str, int] = {}
            found = tree.closest_hit(*rays, *interval(rays, 0, np.inf), options, counters)
            np.testing.assert_array_equal(found[0], expected.t)
            np.testing.assert_array_equal(found[1].view(np.int32), expected.face)
            assert (counters["blockers"] > 20) == covering
            assert occluded(tree, rays, options).all()


@each_core
@pytest.mark.parametrize(
    "case", ["beyond", "all ends", "some before", "some behind", "some inactive"]
)
def test_any_hits_of_tiles_that_one_triangle_covers(core: ModuleType, case: str) -> None:
    """A tile is answered as a whole only if the triangle lies in all rays' intervals."""
    rng = np.random.default_rng(SEED)
    # Two walls that cover the view: one after the other stops tiles of the same thread.
    grid = np.linspace(-0.25, 0.25, 64)
    directions = np.float32([(x, y, 1) for y in grid for x in grid])
    origins = np.full_like(directions, 0.125)
    for depth in (2.0, 5.0):
        rays = origins, directions.copy()
        wall = np.float32([(-9, -9, depth), (9, -9, depth + 1), (0, 27, depth - 1)])
        pieces, faces = workloads.soup(rng, 30, 0.2)
        vertices = np.concatenate([wall, pieces + np.float32((0, 0, depth + 4))])
        tree = build(
            core, (vertices, np.concatenate([np.uint32([[0, 1, 2]]), faces + np.uint32(3)]))
        )
        at_wall = closest(tree, rays, BRUTE_FORCE).t
        t_min = np.zeros(len(directions), np.float32)
        t_max = np.full(len(directions), np.inf, np.float32)
        one = rng.integers(len(directions), size=5)
        if case == "all ends":
            t_max = at_wall.copy()
        elif case == "some before":
            t_max[one] = np.nextafter(at_wall[one], np.float32(0))
        elif case == "some behind":
            t_min[one] = at_wall[one]
        elif case == "some inactive":
            t_max[one] = 0
            rays[1][one[0]] = np.nan
        expected = occluded(tree, rays, BRUTE_FORCE, t_min, t_max)
        assert expected.mean() > 0.99
        for options in (*SHADOW_WAYS, {**SMALL_TILES, "covering_triangles": False}):
            counters: dict[str, int] = {}
            ends = interval(rays, t_min, t_max)
            found = np.asarray(tree.any_hit(*rays, *ends, options, counters), bool)
            np.testing.assert_array_equal(found, expected, err_msg=str((SEED, options)))
            if case != "beyond" or not options.get("covering_triangles", True):
                continue
            assert counters["blockers"] > 0
            if "traversal" not in options:  # adaptive
                # Answered without being traced.
                for what in ("beams", "packets", "traversal_steps", "triangle_tests"):
                    assert counters[what] == 0, (what, options)
