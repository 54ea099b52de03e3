"""Rays from anywhere in one box to anywhere in another, as those to an area light."""

from __future__ import annotations

import itertools
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import BRUTE_FORCE, Options, build, closest, each_core, interval, occluded
from workloads import Rays

SEED = 20261129
BEAM_LEAF: Options = {"traversal": "beam_leaf"}
ADAPTIVE: Options = {"traversal": "adaptive"}

Doubles = npt.NDArray[np.float64]

CORNERS: Doubles = np.array(list(itertools.product((0.0, 1.0), repeat=3)))


def _between(begin: Doubles, end: Doubles) -> Rays:
    """Rays that start at the points of one array and reach those of another at t = 1."""
    start = np.asarray(begin, np.float32)
    return start, np.asarray(end, np.float32) - start


def _in_box(rng: np.random.Generator, count: int, box: Doubles) -> Doubles:
    """Points of a box, given by its lower and upper corner; a third are corners."""
    inner = rng.uniform(0, 1, (count, 3))
    place = np.where(rng.uniform(0, 1, (count, 1)) < 1 / 3, CORNERS[rng.integers(8)], inner)
    return box[0] + place * (box[1] - box[0])


def _random_box(rng: np.random.Generator, size: float) -> Doubles:
    """A box of up to that size, which may be flat, of coordinates that are exact."""
    extent = rng.uniform(0, size, 3) * rng.choice([0, 1, 1], 3)
    corner = rng.uniform(-1, 1, 3)
    return np.float64(workloads.snap(np.stack([corner, corner + extent])))


def _assert_as_brute_force(
    tree: object, rays: Rays, t_min: npt.ArrayLike, t_max: npt.ArrayLike
) -> tuple[float, dict[str, int], dict[str, int]]:
    """Returns which share of the rays is occluded, and counters of beam_leaf and of
    adaptive."""
    expected = occluded(tree, rays, BRUTE_FORCE, t_min=t_min, t_max=t_max)
    counters: dict[str, dict[str, int]] = {}
    for options in (BEAM_LEAF, ADAPTIVE):
        found = tree.any_hit(  # type: ignore[attr-defined]
            *rays,
            *interval(rays, t_min, t_max),
            options,
            counters.setdefault(options["traversal"], {}),
        )
        different = np.flatnonzero(np.asarray(found, bool) != expected)
        assert different.size == 0, (options, different[:4], SEED)
    return float(expected.mean()), counters["beam_leaf"], counters["adaptive"]


@each_core
@pytest.mark.parametrize("triangles", [1, 3, 30, 1000])
def test_rays_between_boxes_are_stopped_as_by_brute_force(
    core: ModuleType, triangles: int
) -> None:
    rng = np.random.default_rng(SEED + triangles)
    shares = []
    beams, given_up = np.zeros(2, int), np.zeros(2, int)
    for _ in range(25):
        tree = build(core, workloads.soup(rng, triangles, rng.choice([0.1, 0.5, 2])))
        size = rng.choice([0.01, 0.1, 1])
        begin, end = _random_box(rng, size), _random_box(rng, size)
        count = int(rng.choice([17, 300, 2500]))
        rays = _between(_in_box(rng, count, begin), _in_box(rng, count, end))
        t_min = rng.choice(np.array([0, 0, 0.2, -1], np.float32), count)
        t_max = rng.choice(np.array([1, 1, 0.3, 0, -1, np.nan], np.float32), count)
        share, *counters = _assert_as_brute_force(tree, rays, t_min, t_max)
        shares.append(share)
        beams += [each["beams"] for each in counters]
        given_up += [each["fallbacks"] for each in counters]
    assert 0 < np.mean(shares) < 1, SEED
    assert np.all(beams > 0), SEED
    assert np.all((given_up > 0) == (triangles > 30)), SEED


@each_core
@pytest.mark.parametrize("offset", [0.0, 1024.0], ids=["at the centre", "far away"])
def test_triangles_that_touch_the_hull(core: ModuleType, offset: float) -> None:
    """Each triangle touches a line from a corner of one box to a corner of the other, and
    lies beyond the hull else, so that it stops rays along this line alone."""
    rng = np.random.default_rng(SEED)
    stopped = 0
    beams = np.zeros(2, int)
    for _ in range(150):
        begin, end = _random_box(rng, 0.5), _random_box(rng, 0.5)
        corners = [box[0] + CORNERS * (box[1] - box[0]) for box in (begin, end)]
        middle = (begin.mean(axis=0) + end.mean(axis=0)) / 2
        start, stop = corners[0][rng.integers(8)], corners[1][rng.integers(8)]
        # Middles of points on a grid are exact, and so is the ray through them.
        touched = (start + stop) / 2
        outward = touched - middle
        if not np.any(outward):
            continue
        others = (
            touched + outward * rng.uniform(0.1, 2, (2, 1)) + rng.uniform(-1, 1, (2, 3))
        )
        others += np.maximum(0, (touched - others) @ outward)[:, None] * outward
        vertices = np.vstack(
            [workloads.snap([touched, *others]), np.float32([touched] * 3)]
        )
        vertices[0] = touched
        tree = build(
            core, (vertices[:3] + np.float32(offset), np.array([[0, 1, 2]], np.uint32))
        )
        pairs = np.array(list(itertools.product(corners[0], corners[1])))
        own = np.repeat([[start, stop]], 16, axis=0)
        pairs = np.concatenate([pairs, own]) + offset
        rays = _between(pairs[:, 0], pairs[:, 1])
        share, *counters = _assert_as_brute_force(tree, rays, 0, 1)
        stopped += share > 0
        beams += [each["beams"] for each in counters]
    assert stopped > 100 and np.all(beams > 100), SEED


@each_core
@pytest.mark.parametrize("exponent", [-100, -40, -20, 0, 30, 60])
def test_ends_just_at_hits_at_any_scale(core: ModuleType, exponent: int) -> None:
    rng = np.random.default_rng(SEED)
    scale = np.float32(2.0**exponent)
    for triangles in (2, 12):
        vertices, faces = workloads.soup(rng, triangles, 0.8)
        tree = build(core, (vertices * scale, faces))
        away = np.float64([0, 0, 2])
        begin, end = _random_box(rng, 0.2) + away, _random_box(rng, 0.2) - away
        start, along = _between(_in_box(rng, 512, begin), _in_box(rng, 512, end))
        rays = start * scale, along * scale
        t = closest(tree, rays, BRUTE_FORCE).t
        reachable = np.where(np.isinf(t), np.float32(1), t)
        for t_max in (reachable, np.nextafter(reachable, np.float32(0)), 1.0):
            _assert_as_brute_force(tree, rays, 0, t_max)
        # Rays that start where they hit, but for roundings, and go on.
        onward = (start + reachable[:, None] * along) * scale, rays[1]
        _assert_as_brute_force(tree, onward, 0, 1 - reachable)


@each_core
@pytest.mark.parametrize("exponent", [60, 119, 127])
def test_ends_that_are_the_smallest_number(core: ModuleType, exponent: int) -> None:
    """Distances up to 1.5 times the smallest number round to it, and hits there count."""
    smallest = 2.0**-149
    aside = np.linspace(0, 1e-3, 32)[:, None] * [1, 0, 0]
    origins = (aside * 2.0**exponent * smallest).astype(np.float32)
    # Not parallel.
    directions = ((aside + np.float64([0, 0, 1])) * 2.0**exponent).astype(np.float32)
    for share, stops in ((0.75, True), (1.25, True), (1.45, True), (1.75, False)):
        sheet = np.float64([[-1, -1, share], [2, -1, share], [-1, 2, share]])
        vertices = (sheet * 2.0**exponent * smallest).astype(np.float32)
        tree = build(core, (vertices, np.array([[0, 1, 2]], np.uint32)))
        for options in (BRUTE_FORCE, BEAM_LEAF, ADAPTIVE):
            found = occluded(tree, (origins, directions), options, t_max=smallest)
            np.testing.assert_array_equal(found, stops, f"{options} {share}")


@each_core
def test_rays_that_are_no_numbers_or_go_nowhere_or_on_for_ever(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 4, 0.8))
    start, along = _between(
        _in_box(rng, 320, _random_box(rng, 1)), rng.uniform(-1, 1, (320, 3))
    )
    for odd in (np.nan, np.inf, -np.inf, 0.0, 1e-30, 3e38):
        for of in (start, along):
            spoiled = of.copy()
            spoiled[rng.uniform(0, 1, 320) < 0.1] = odd
            spoiled[rng.uniform(0, 1, 320) < 0.1, rng.integers(3)] = odd
            rays = (spoiled, along) if of is start else (start, spoiled)
            for t_max in (1, 3e38, np.inf):
                _assert_as_brute_force(tree, rays, 0, t_max)


@each_core
def test_an_empty_scene_stops_nothing(core: ModuleType) -> None:
    tree = build(core, (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)))
    rng = np.random.default_rng(SEED)
    rays = _between(rng.uniform(0, 1, (100, 3)), rng.uniform(2, 3, (100, 3)))
    assert not np.any(occluded(tree, rays, ADAPTIVE, t_max=1))


@each_core
def test_no_ray_between_boxes_passes_a_closed_mesh(core: ModuleType) -> None:
    """From within a sphere through its vertices and the middles of its edges."""
    vertices, faces = workloads.sphere(2)
    # In small leaves, whose triangles are not too many for a shaft.
    tree = build(core, (vertices, faces), intersection_cost=0.375)
    edges = vertices[faces[:, [0, 1]]].mean(axis=1)
    rng = np.random.default_rng(SEED)
    beams = 0
    for target in np.float64(np.concatenate([vertices, edges])):
        counters: dict[str, int] = {}
        start = rng.uniform(-0.02, 0.02, (64, 3))
        rays = _between(start, start + 1.5 * (target - start))
        found = tree.any_hit(*rays, *interval(rays, 0, 1), BEAM_LEAF, counters)
        assert np.all(np.asarray(found, bool)), target
        beams += counters["beams"]
    assert beams > 0 and counters["beams"] > 0
