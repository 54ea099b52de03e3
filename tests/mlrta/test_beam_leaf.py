"""The parts of the beam-leaf traversal: its bounds against exact fractions."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from exact_volumes import lanes, volumes
from tracing import BRUTE_FORCE, Options, build, closest, each_core, interval, occluded

SEED = 20261127
FloatArray = npt.NDArray[np.float32]
ORIGIN = np.array([0.3, -0.2, 0.1], np.float32)
BEAM_LEAF: Options = {"traversal": "beam_leaf"}
ADAPTIVE: Options = {"traversal": "adaptive"}


def bundle(rng: np.random.Generator, spread: float, count: int = 256) -> FloatArray:
    """Directions of any length about a random one."""
    middle = rng.normal(0, 1, 3)
    middle /= np.linalg.norm(middle)
    directions = middle + rng.uniform(-spread, spread, (count, 3))
    return np.asarray(directions * rng.uniform(0.1, 10, (count, 1)), np.float32)


def triangles_ahead(rng: np.random.Generator, directions: FloatArray) -> FloatArray:
    """Eight triangles (8, 3, 3) that rays go through or pass by, of all shapes."""
    found = []
    for size in (1.0, 0.1, 0.01, 1e-3):
        for shape in ("any", "sliver"):
            d = directions[rng.integers(len(directions))].astype(np.float64)
            centre = ORIGIN + d / np.linalg.norm(d) * rng.uniform(1, 20)
            corners = centre + rng.uniform(-size, size, (3, 3))
            if shape == "sliver":
                corners[2] = 0.5 * (corners[0] + corners[1])
                corners[2] += rng.uniform(-1e-4, 1e-4, 3) * size
            found.append(corners)
    return np.asarray(found, np.float32)


def fused(a: np.float32, b: np.float32, c: np.float32) -> np.float32:
    """a b + c, but for a rounding to double precision on the way."""
    return np.float32(np.float64(a) * np.float64(b) + np.float64(c))


class ExactBeam:
    """The rays of a beam in the coordinates that it chose, as fractions: slopes are those
    relative to its common ones."""

    def __init__(self, beam: Any, directions: FloatArray) -> None:
        self.told = beam.describe()
        self.axes = list(self.told["axes"])
        self.side = Fraction(self.told["side"])
        self.rays = [
            16 * n + lane
            for n, packet in enumerate(self.told["packets"])
            for lane in lanes(packet["active"])
        ]
        self.slopes = {}
        self.main = {}
        for ray in self.rays:
            i, j, k = (Fraction(float(directions[ray][axis])) for axis in self.axes)
            assert k * self.side > 0
            self.main[ray] = abs(k)
            common_u, common_v = map(Fraction, self.told["common_slopes"])
            self.slopes[ray] = (i / abs(k) - common_u, j / abs(k) - common_v)


@each_core
@pytest.mark.parametrize("spread", [1e-6, 1e-3, 0.03, 0.4])
def test_rectangles_hold_all_rays(core: ModuleType, spread: float) -> None:
    rng = np.random.default_rng(SEED)
    for count in [256] * 7 + [40, 1000, 1024]:
        directions = bundle(rng, spread, count)
        exact = ExactBeam(core.beam_leaf_selftest.Beam(ORIGIN, directions), directions)
        assert len(exact.rays) > 0.4 * count, SEED
        u, v, c, s, half_p, half_q = map(Fraction, exact.told["rectangle"])
        for ray in exact.rays:
            du, dv = exact.slopes[ray][0] - u, exact.slopes[ray][1] - v
            # The sides need not have unit length: coordinates by Cramer's rule.
            p = (du * c + dv * s) / (c * c + s * s)
            q = (dv * c - du * s) / (c * c + s * s)
            assert abs(p) <= half_p and abs(q) <= half_q, (SEED, ray)
            box = map(Fraction, exact.told["packets"][ray // 16]["box"])
            packet_p, packet_q, packet_half_p, packet_half_q = box
            assert abs(p - packet_p) <= packet_half_p, (SEED, ray)
            assert abs(q - packet_q) <= packet_half_q, (SEED, ray)


@each_core
@pytest.mark.parametrize("spread", [1e-6, 1e-3, 0.05])
def test_forms_are_as_near_as_they_say(core: ModuleType, spread: float) -> None:
    rng = np.random.default_rng(SEED)
    safe = 0
    for _ in range(8):
        directions = bundle(rng, spread, 64)
        beam = core.beam_leaf_selftest.Beam(ORIGIN, directions)
        exact = ExactBeam(beam, directions)
        triangles = triangles_ahead(rng, directions)
        told = beam.forms(triangles.reshape(-1, 3))
        for n in lanes(told["possible"]):
            safe += 1
            edge_error = Fraction(told["ray_error"][n])
            assert edge_error <= Fraction(told["edge_error"][n])
            for ray in exact.rays[::7]:
                edges, along, volume = volumes(ORIGIN, directions[ray], triangles[n])
                # Rounded as the beam does it.
                i, j, k = (directions[ray][axis] for axis in exact.axes)
                reciprocal = np.float32(1) / abs(k)
                slope_u, slope_v = map(np.float32, exact.told["common_slopes"])
                u = fused(-slope_u, abs(k), i) * reciprocal
                v = fused(-slope_v, abs(k), j) * reciprocal
                values = [
                    fused(of_u[n], u, fused(of_v[n], v, one[n]))
                    for one, of_u, of_v in (map(np.float32, form) for form in told["forms"])
                ]
                for value, edge in zip(values[:3], edges, strict=True):
                    # The computed form is divided by the computed volume, which may be
                    # off by a quarter: compare signs that are certain.
                    true = edge / exact.main[ray] / abs(volume) * (1 if volume > 0 else -1)
                    if Fraction(float(value)) > edge_error:
                        assert true > 0, (SEED, n, ray)
                    if Fraction(float(value)) < -edge_error:
                        assert true < 0, (SEED, n, ray)
                    assert abs(Fraction(float(value)) - true) <= edge_error + abs(
                        true
                    ) * Fraction(1, 1000), (SEED, n, ray)
                depth = along / volume / exact.main[ray]
                if depth > 0:
                    x = Fraction(float(values[3]))
                    error = Fraction(told["depth_error"][n])
                    assert x * Fraction(told["depth_shrink"][n]) - error <= depth
                    assert depth <= x * Fraction(told["depth_grow"][n]) + error
    assert safe > (25 if spread > 1e-4 else 8), SEED


@each_core
def test_small_triangles_of_narrow_beams_keep_their_digits(core: ModuleType) -> None:
    """The error of their forms is a share of how far apart the rays are, and not of where
    they go."""
    rng = np.random.default_rng(SEED)
    compared = 0
    for _ in range(20):
        directions = bundle(rng, 0.2, 64)
        narrow = directions[0] * (1 + 0 * directions)
        narrow += np.float32(1e-4) * np.abs(narrow).max() * rng.uniform(-1, 1, (64, 3))
        corners = ORIGIN + 5 * directions[0] / np.linalg.norm(directions[0])
        triangle = np.float32(corners + rng.uniform(-1e-3, 1e-3, (3, 3)))
        errors = []
        for rays in (directions, np.float32(narrow)):
            told = core.beam_leaf_selftest.Beam(ORIGIN, rays).forms(triangle)
            errors.append(told["ray_error"][0] if told["possible"] & 1 else np.inf)
        if np.isfinite(errors).all():
            compared += 1
            assert errors[1] < errors[0] / 50, (SEED, errors)
    assert compared > 10, SEED


@each_core
@pytest.mark.parametrize("spread", [1e-6, 1e-3, 0.05, 0.4])
def test_no_triangle_that_is_hit_is_rejected(core: ModuleType, spread: float) -> None:
    rng = np.random.default_rng(SEED)
    hit = rejected = rejected_by_runs = 0
    for count in [64] * 12 + [600]:
        # Runs of 256 rays are parted a little, so that they are not all alike.
        directions = bundle(rng, spread, count)
        shift = np.arange(count)[:, None] // 256 * np.float32(spread)
        directions += shift * np.abs(directions).max(1, keepdims=True)
        beam = core.beam_leaf_selftest.Beam(ORIGIN, directions)
        exact = ExactBeam(beam, directions)
        triangles = triangles_ahead(rng, directions)
        told = beam.forms(triangles.reshape(-1, 3))
        for n in range(8):
            kept = (told["possible"] | told["unsafe"]) >> n & 1
            rejected += not kept
            kept_by_runs = [bits >> n & 1 for bits in told["possible_for_runs"]]
            rejected_by_runs += bool(told["possible"] >> n & 1) and not all(kept_by_runs)
            for ray in exact.rays:
                edges, along, volume = volumes(ORIGIN, directions[ray], triangles[n])
                same = all(e >= 0 for e in edges) or all(e <= 0 for e in edges)
                if same and any(edges) and along * volume > 0:
                    hit += 1
                    assert kept, (SEED, n, ray)
                    assert kept_by_runs[ray // 256] or told["unsafe"] >> n & 1
    assert hit > 8, SEED
    assert rejected > 0 or spread > 0.1, SEED
    assert rejected_by_runs > 0 or spread < 1e-4, SEED


@each_core
def test_the_grid_finds_every_ray(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    missed = 0
    for spread in (1e-3, 0.05):
        directions = bundle(rng, spread)
        beam = core.beam_leaf_selftest.Beam(ORIGIN, directions)
        exact = ExactBeam(beam, directions)
        u, v, c, s, half_p, half_q = map(Fraction, exact.told["rectangle"])
        for ray in exact.rays[::5]:
            du, dv = exact.slopes[ray][0] - u, exact.slopes[ray][1] - v
            p, q = float(du * c + dv * s), float(dv * c - du * s)
            # A box around the ray, as narrow as triangles are told with.
            half = 32 * 2.0**-24 * 3
            assert beam.grid_may_hit(p, q, half, half), (SEED, ray)
        for _ in range(200):
            p = rng.uniform(-1, 1) * float(half_p)
            q = rng.uniform(-1, 1) * float(half_q)
            missed += not beam.grid_may_hit(p, q, 1e-3 * float(half_p), 0)
    assert missed > 200, SEED


@each_core
@pytest.mark.parametrize("share", [0.6, 0.9])
def test_regrouping_keeps_every_ray(core: ModuleType, share: float) -> None:
    rng = np.random.default_rng(SEED)
    cuts = 0
    for gap in (0.0, 0.2):
        one, other = bundle(rng, 0.01, 128), bundle(rng, 0.01, 128)
        directions = np.concatenate([one, one[rng.permutation(128)]])
        directions[128:] += np.float32(gap) * np.abs(directions[128:]).max(1, keepdims=True)
        assert other.shape == one.shape
        beam = core.beam_leaf_selftest.Beam(ORIGIN, directions)
        active = ExactBeam(beam, directions).rays
        order, before, beyond = beam.order(share)
        assert sorted(order) == active
        assert sorted(before + beyond) in (active, [])
        if gap > 0:
            cuts += 1
            half = [r for r in active if r < 128]
            other_half = [r for r in active if r >= 128]
            assert (before, beyond) in ((half, other_half), (other_half, half))
    assert cuts == 1


ROUND_THE_ORIGIN = {
    "all around": lambda rng: rng.normal(0, 1, (3000, 3)),
    "two bundles": lambda rng: np.concatenate(
        [bundle(rng, 0.05, 700), bundle(rng, 0.05, 701)]
    ),
    "axes and diagonals": lambda rng: rng.integers(-1, 2, (2000, 3)),
    "in a plane": lambda rng: rng.normal(0, 1, (1000, 3)) * [1, 0, 1],
    "lines": lambda rng: np.repeat(rng.normal(0, 1, (5, 3)), 111, axis=0),
}


@each_core
@pytest.mark.parametrize("name", ROUND_THE_ORIGIN)
@pytest.mark.parametrize("options", [BEAM_LEAF, ADAPTIVE], ids=["beam_leaf", "adaptive"])
def test_any_bundle_finds_what_brute_force_does(
    core: ModuleType, name: str, options: Options
) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 400, 0.2)
    tree = build(core, scene)
    for origin in (ORIGIN, scene[0][0], np.zeros(3, np.float32)):
        directions = np.asarray(ROUND_THE_ORIGIN[name](rng), np.float32)
        directions[::17] *= np.float32(2.0**-70)  # strays
        directions[5::19] = 0  # inactive
        origins = np.broadcast_to(origin, directions.shape).astype(np.float32)
        t_max = rng.choice(np.array([np.inf, 0.7, 0.2], np.float32), len(directions))
        rays = origins, directions
        expected = closest(tree, rays, BRUTE_FORCE, t_max=t_max)
        closest(tree, rays, options, t_max=t_max).assert_same(expected)
        assert np.array_equal(
            occluded(tree, rays, options, t_max=t_max), expected.face >= 0
        ), SEED


@each_core
def test_few_rays_among_many_triangles(core: ModuleType) -> None:
    """Beams that test many triangles for each of their rays are given up for packets."""
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 20_000, 0.02)
    tree = build(core, scene)
    directions = np.asarray(rng.uniform(-0.3, 0.3, (64, 3)), np.float32)
    directions[:, 2] += 1
    origins = np.broadcast_to(np.float32([0.5, 0.5, -3]), directions.shape)
    rays = np.ascontiguousarray(origins, np.float32), directions
    expected = closest(tree, rays, BRUTE_FORCE)
    closest(tree, rays, ADAPTIVE).assert_same(expected)
    assert np.array_equal(occluded(tree, rays, ADAPTIVE), expected.face >= 0)
    for options, given_up in ((ADAPTIVE, True), (BEAM_LEAF, False)):
        counters: dict[str, int] = {}
        tree.closest_hit(*rays, *interval(rays, 0, np.inf), options, counters)
        assert counters["beams"] > 0
        assert (counters["fallbacks"] > 0) == given_up


@each_core
def test_surfaces_that_lie_in_one_plane(core: ModuleType) -> None:
    """Equal distances go to the lowest number, whichever triangle a beam meets first."""
    rng = np.random.default_rng(SEED)
    any_plane = rng.uniform(-1, 1, (30, 3, 3))
    any_plane[:, :, 2] += 4
    across = rng.uniform(-1, 1, (30, 3, 3))
    across[:, :, 2] = rng.choice([3, 3.5], (30, 1))
    triangles = np.concatenate([any_plane, across]).astype(np.float32)
    nearly = triangles.copy()
    nearly[:, 1, 2] = np.nextafter(nearly[:, 1, 2], np.float32(9))
    scene = np.concatenate([triangles, triangles[:, [1, 2, 0]], triangles[:, ::-1], nearly])
    scene = scene[rng.permutation(len(scene))]
    faces = np.arange(3 * len(scene), dtype=np.uint32).reshape(-1, 3)
    tree = build(core, (np.ascontiguousarray(scene.reshape(-1, 3)), faces))
    directions = np.asarray(rng.uniform(-0.3, 0.3, (3000, 3)), np.float32)
    directions[:, 2] = 1
    rays = np.zeros_like(directions), directions
    expected = closest(tree, rays, BRUTE_FORCE)
    assert np.count_nonzero(expected.face >= 0) > 1000, SEED
    for options in (BEAM_LEAF, ADAPTIVE):
        closest(tree, rays, options).assert_same(expected)
    counters: dict[str, int] = {}
    tree.closest_hit(*rays, *interval(rays, 0, np.inf), BEAM_LEAF, counters)
    assert counters["double_tests"] > 1000, SEED


@each_core
def test_each_ray_is_counted_once_where_beams_are_given_up(core: ModuleType) -> None:
    """Half of the rays end at a wall, the others in a dense cloud behind it."""
    count = 100_000
    rng = np.random.default_rng(SEED)
    corners = rng.uniform(-1, 1, (count, 1, 3)) + rng.uniform(-0.02, 0.02, (count, 3, 3))
    corners += [0, 0, 10]
    wall = [[-9, -9, 5], [0, -9, 5], [-9, 9, 5]], [[0, -9, 5], [0, 9, 5], [-9, 9, 5]]
    vertices = np.float32(np.concatenate([corners, wall]).reshape(-1, 3))
    tree = build(core, (vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)))
    directions = np.ones((256, 3), np.float32)
    directions[:, :2] = rng.uniform(-0.08, 0.08, (256, 2))
    rays = np.zeros_like(directions), directions
    for query in (tree.closest_hit, tree.any_hit):
        for _ in range(2):
            counters: dict[str, int] = {}
            query(*rays, *interval(rays, 0, np.inf), ADAPTIVE, counters)
            assert counters["rays"] == 256
            assert counters["fallbacks"] > 0, "the case that this is about"
            tree.widen()
