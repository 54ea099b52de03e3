"""Beams of a camera that are bounded by the film, and packets that one triangle covers:
against exact fractions and brute force."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import BRUTE_FORCE, TRAVERSALS, Options, build, closest, each_core

SEED = 20261129
FloatArray = npt.NDArray[np.float32]


@dataclass(frozen=True)
class Tile:
    """Rays of a square of pixels, as trace_closest() takes them.

    map: base, dx and dy. square: x, y, size, samples, and where in their pixel samples
    begin and end to lie. directions: (N, 3).
    """

    origin: Any
    map: Any
    square: tuple[int, int, int, int, float, float]
    directions: FloatArray

    @property
    def count(self) -> int:
        return len(self.directions)


def random_map(rng: np.random.Generator) -> npt.NDArray[np.float32]:
    """Base, dx and dy of a film of about 64 x 64 pixels, as rows: along axes or turned,
    narrow or wide, sheared or not, of any scale."""
    frame = np.roll(np.eye(3), rng.integers(3), axis=0) * rng.choice([-1, 1], 3)
    if rng.random() < 0.6:
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    width = rng.choice([1e-4, 0.01, 0.5, 2.0])
    right, up = frame[0], frame[1] * rng.choice([0.1, 1.0])
    if rng.random() < 0.3:
        up = up + right * rng.uniform(-0.5, 0.5)
    base = frame[2] - (right + up) * width / 2
    scale = rng.choice([1.0, 0.03, 1e4])
    return np.float32(scale * np.array([base, right * width / 64, up * width / 64]))


def random_tile(rng: np.random.Generator, samples: int, size: int) -> Tile:
    rows = random_map(rng)
    x, y = (int(k) * size for k in rng.integers(0, 64 // size, 2))
    begin, end = ((0.0, 1.0), (0.5, 0.5), (0.125, 0.875))[rng.integers(3)]
    code = np.repeat(np.arange(size * size), samples)
    column = sum((code >> 2 * bit & 1) << bit for bit in range(8))
    row = sum((code >> 2 * bit + 1 & 1) << bit for bit in range(8))
    offsets = rng.choice([begin, end, rng.uniform(begin, end)], (2, len(code)))
    if rng.random() < 0.5:
        offsets = rng.uniform(begin, end, (2, len(code)))
    film_x = np.float32(x + column + offsets[0])
    film_y = np.float32(y + row + offsets[1])
    base, dx, dy = rows
    # As the renderer rounds it.
    directions = (base + film_x[:, None] * dx) + film_y[:, None] * dy
    origin = np.float32(rng.normal(size=3))
    return Tile(
        tuple(map(float, origin)),
        [tuple(map(float, line)) for line in rows],
        (x, y, size, samples, begin, end),
        np.ascontiguousarray(directions, np.float32),
    )


def beam_of(
    core: ModuleType, tile: Tile, first: int, count: int, t_min: float, t_max: float
) -> Any:
    return core.beam_leaf_selftest.Beam(
        tile.origin, tile.directions, tile.map, tile.square, first, count, t_min, t_max
    )


def exact_slopes(told: Any, direction: FloatArray) -> tuple[Fraction, Fraction, Fraction]:
    """u, v and |d_k| of a ray in the coordinates of a beam."""
    i, j, k = (Fraction(float(direction[axis])) for axis in told["axes"])
    assert k * Fraction(told["side"]) > 0
    return i / abs(k), j / abs(k), abs(k)


@each_core
@pytest.mark.parametrize("samples", [1, 2, 4, 8, 16, 32])
def test_the_film_bounds_all_rays(core: ModuleType, samples: int) -> None:
    rng = np.random.default_rng([SEED, samples])
    by_film = 0
    for _ in range(12):
        tile = random_tile(rng, samples, max(16 // samples, 4))
        t_min, t_max = float(rng.choice([0, 0.5])), float(rng.choice([2, 1e4, np.inf]))
        for count in (16, 64, 256, tile.count):
            if count > tile.count:
                continue
            first = int(rng.integers(tile.count // count)) * count
            told = beam_of(core, tile, first, count, t_min, t_max).describe()
            by_film += told["is_by_film"]
            if told["is_by_film"]:
                assert_bounds(told, tile, first, count, t_min, t_max)
    assert by_film > 20, SEED


@each_core
@pytest.mark.parametrize(("samples", "size"), [(1, 64), (16, 16)])
def test_the_film_bounds_all_rays_of_the_largest_beams(
    core: ModuleType, samples: int, size: int
) -> None:
    rng = np.random.default_rng([SEED, samples, size])
    by_film = 0
    while by_film < 2:
        tile = random_tile(rng, samples, size)
        assert tile.count == 4096
        told = beam_of(core, tile, 0, tile.count, 0.5, 1e4).describe()
        by_film += told["is_by_film"]
        if told["is_by_film"]:
            assert_bounds(told, tile, 0, tile.count, 0.5, 1e4)


def assert_bounds(
    told: Any, tile: Tile, first: int, count: int, t_min: float, t_max: float
) -> None:
    lo_u, hi_u, lo_v, hi_v = map(Fraction, told["slopes"])
    assert [packet["first_ray"] for packet in told["packets"]] == list(
        range(first, first + count, 16)
    )
    for ray in range(first, first + count):
        packet = told["packets"][(ray - first) // 16]
        assert packet["active"] == 0xFFFF and packet["strays"] == 0
        u, v, main = exact_slopes(told, tile.directions[ray])
        assert lo_u <= u <= hi_u and lo_v <= v <= hi_v, (SEED, ray)
        assert_in_boxes(told, packet, u, v)
        least, greatest = map(Fraction, packet["reciprocal_depths"])
        at_end = 0 if t_max == np.inf else 1 / (Fraction(t_max) * main)
        assert least <= at_end <= greatest, (SEED, ray)
        # What lies nearer than that lies before t_min; told of every ray.
        assert Fraction(told["nearest"]) * Fraction(t_min) * main <= 1


def assert_in_boxes(told: Any, packet: Any, u: Fraction, v: Fraction) -> None:
    """That a ray of a packet lies in the rectangle and in the boxes around it."""
    center_u, center_v, c, s, half_p, half_q = map(Fraction, told["rectangle"])
    common_u, common_v = map(Fraction, told["common_slopes"])
    du, dv = u - common_u - center_u, v - common_v - center_v
    # The sides need not have unit length: coordinates by Cramer's rule.
    p = (du * c + dv * s) / (c * c + s * s)
    q = (dv * c - du * s) / (c * c + s * s)
    assert abs(p) <= half_p and abs(q) <= half_q, SEED
    for box in (packet["box"], packet["box_of_run"]):
        box_p, box_q, box_half_p, box_half_q = map(Fraction, box)
        assert abs(p - box_p) <= box_half_p and abs(q - box_q) <= box_half_q, SEED


@each_core
def test_beams_of_a_tiny_camera_map_are_turned_as_any_other(core: ModuleType) -> None:
    """Its squares underflow. Three samples a pixel leave bounds by the film out."""
    rng = np.random.default_rng([SEED, 7])
    turned = 0
    for _ in range(12):
        tile = random_tile(rng, 3, 8)
        size = np.float32(0.9 * 2.0**-59 / np.abs(tile.directions).max())
        rows = [tuple(float(np.float32(x) * size) for x in row) for row in tile.map]
        tiny = Tile(tile.origin, rows, tile.square, np.float32(tile.directions * size))
        told = beam_of(core, tiny, 0, tiny.count, 0, np.inf).describe()
        assert not told["is_by_film"]
        if any(packet["strays"] for packet in told["packets"]):
            continue
        cosine, sine = told["rectangle"][2:4]
        assert abs(cosine * cosine + sine * sine - 1) < 4 * 2.0**-24, SEED
        for ray in range(tiny.count):
            u, v, _ = exact_slopes(told, tiny.directions[ray])
            assert_in_boxes(told, told["packets"][ray // 16], u, v)
        turned += 1
    assert turned > 6, SEED


@each_core
def test_the_spread_holds_in_all_boxes(core: ModuleType) -> None:
    """Of a film that is seen at a slant, boxes reach beyond the rectangle."""
    base, dx, dy = (0.0, 0.0, 0.05), (0.06, 0.0, 0.06), (0.0, 0.001, 0.0)
    square = (0, 0, 16, 1, 0.0, 1.0)
    code = np.arange(256)
    column = sum((code >> 2 * bit & 1) << bit for bit in range(4))
    row = sum((code >> 2 * bit + 1 & 1) << bit for bit in range(4))
    x, y = np.float32(column + 0.5)[:, None], np.float32(row + 0.5)[:, None]
    directions = (np.float32(base) + x * np.float32(dx)) + y * np.float32(dy)
    tile = Tile((0.0, 0.0, 0.0), [base, dx, dy], square, directions)
    told = beam_of(core, tile, 0, 256, 0, np.inf).describe()
    assert told["is_by_film"]
    center_u, center_v, _, _, half_p, half_q = told["rectangle"]
    beyond = 0
    for packet in told["packets"]:
        for p, q, box_half_p, box_half_q in (packet["box"], packet["box_of_run"]):
            reach_p, reach_q = abs(p) + box_half_p, abs(q) + box_half_q
            beyond += reach_p > 1.5 * half_p or reach_q > 1.5 * half_q
            greatest = abs(center_u) + abs(center_v) + np.sqrt(2) * (reach_p + reach_q)
            assert greatest <= told["spread"]
    assert beyond > 0


@each_core
def test_a_tile_without_rays_has_no_hits(core: ModuleType) -> None:
    tree = build(core, (np.eye(3, dtype=np.float32), np.int32([[0, 1, 2]])))
    rows = [(0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    none = np.zeros((0, 3), np.float32)
    for way in WAYS:
        t, face, _ = core.beam_leaf_selftest.trace_tile(
            tree, (0.0, 0.0, 0.0), none, rows, (0, 0, 1, 1, 0.0, 1.0), 0.0, np.inf, way
        )
        assert len(t) == 0 and len(face) == 0


@each_core
def test_film_bounds_are_not_much_wider_than_the_rays(core: ModuleType) -> None:
    """Else triangles would be tested in vain."""
    rng = np.random.default_rng(SEED)
    for _ in range(20):
        tile = random_tile(rng, 1, 32)
        told = beam_of(core, tile, 0, tile.count, 0, np.inf).describe()
        plain = core.beam_leaf_selftest.Beam(tile.origin, tile.directions).describe()
        if not told["is_by_film"] or abs(tile.map[1][0]) + abs(tile.map[1][1]) < 1e-4:
            continue
        area = told["rectangle"][4] * told["rectangle"][5]
        assert area <= 2.5 * plain["rectangle"][4] * plain["rectangle"][5] + 1e-12


@each_core
def test_rays_that_differ_in_their_ends_are_looked_at(core: ModuleType) -> None:
    tile = random_tile(np.random.default_rng(SEED), 1, 8)
    assert beam_of(core, tile, 0, 64, 0, 1).describe()["is_by_film"]
    for t_min, t_max in ((1, 1), (2, 1), (0, np.nan), (np.nan, 1), (0, -1)):
        assert not beam_of(core, tile, 0, 64, t_min, t_max).describe()["is_by_film"]


@each_core
def test_covered_packets_are_hit_by_all_rays(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    covered = too_small = 0
    for _ in range(40):
        tile = random_tile(rng, int(rng.choice([1, 4, 16])), 8)
        count = min(tile.count, 256)
        beam = beam_of(core, tile, 0, count, 0, np.inf)
        told = beam.describe()
        triangles = []
        for _ in range(8):
            ahead = np.float64(tile.directions[rng.integers(count)]) * rng.uniform(1, 9)
            size = np.linalg.norm(ahead) * rng.choice([0.003, 0.05, 1.0])
            corners = tile.origin + ahead + rng.uniform(-size, size, (3, 3))
            triangles.append(np.float32(corners))
        vertices = np.ascontiguousarray(np.concatenate(triangles), np.float32)
        forms = beam.forms(vertices)
        too_small += (forms["possible"] & ~forms["possible_covers"]).bit_count()
        for number, packet, least, greatest, is_large in beam.covered_packets(vertices):
            covered += 1
            assert is_large, (SEED, number)
            for ray in range(16 * packet, 16 * packet + 16):
                direction = tile.directions[ray]
                depth = hit_depth(tile.origin, direction, triangles[number], told)
                assert depth is not None, (SEED, number, ray)
                assert Fraction(least) <= 1 / depth <= Fraction(greatest), (SEED, ray)
    assert covered > 300, (SEED, covered)
    assert too_small > 10, (SEED, too_small)


def hit_depth(
    origin: Any, direction: FloatArray, triangle: FloatArray, told: Any
) -> Fraction | None:
    """t |d_k| where the ray hits the triangle between its edges, exactly."""
    o, d = ([Fraction(float(x)) for x in point] for point in (origin, direction))
    a, b, c = (
        [Fraction(float(x)) - y for x, y in zip(corner, o, strict=True)]
        for corner in triangle
    )

    def cross(p: list[Fraction], q: list[Fraction]) -> list[Fraction]:
        return [p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3]
                for k in range(3)]  # fmt: skip

    def dot(p: list[Fraction], q: list[Fraction]) -> Fraction:
        return sum((x * y for x, y in zip(p, q, strict=True)), Fraction(0))

    volumes = [dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))]
    total = sum(volumes, Fraction(0))
    if total == 0 or any(volume * total < 0 for volume in volumes):
        return None
    t = dot(a, cross(b, c)) / total
    return t * abs(d[told["axes"][2]]) if t > 0 else None


WAYS: list[Options] = [
    TRAVERSALS["beam_leaf"],
    TRAVERSALS["adaptive"],
    {"traversal": "beam_leaf", "entry_points": True, "initial_tile": 32, "minimum_tile": 8},
    {"traversal": "adaptive", "entry_points": True},
    {"traversal": "interval", "entry_points": True, "initial_tile": 16, "minimum_tile": 4},
]


@each_core
@pytest.mark.parametrize("samples", [1, 2, 3, 4, 16, 64])
def test_tiles_find_what_brute_force_does(core: ModuleType, samples: int) -> None:
    """Among few large triangles, which cover packets, in one plane and not, and many small
    ones, which meet edges and vertices of rays."""
    rng = np.random.default_rng([SEED, samples])
    hits, lazy = 0, 0
    for round_ in range(8):
        tile = random_tile(rng, samples, 8 if samples > 16 else 32 if samples == 1 else 16)
        scene = scene_ahead(rng, tile, round_ % 4)
        tree = build(core, scene)
        t_min, t_max = 0.0, float(rng.choice([np.inf, 4.0]))
        origins = np.tile(np.float32(tile.origin), (tile.count, 1))
        exact = closest(tree, (origins, tile.directions), BRUTE_FORCE, t_min, t_max)
        hits += int((exact.face >= 0).sum())
        for way in WAYS:
            t, face, counters = core.beam_leaf_selftest.trace_tile(
                tree, tile.origin, tile.directions, tile.map, tile.square, t_min, t_max, way
            )
            face = face.view(np.int32)
            assert np.array_equal(face, exact.face), (SEED, samples, round_, way)
            assert np.array_equal(t, exact.t), (SEED, samples, round_, way)
            packets = tile.count / 16
            lazy += counters["beams"] > 0 and counters["triangle_tests"] < packets
    assert hits > 2000 and (lazy > 0 or samples == 3), (SEED, hits, lazy)


@each_core
@pytest.mark.parametrize(("samples", "size"), [(1, 64), (16, 16)])
def test_the_largest_beams_are_divided_where_they_meet_many_triangles(
    core: ModuleType, samples: int, size: int
) -> None:
    rng = np.random.default_rng([SEED, samples, 1])
    tile = random_tile(rng, samples, size)
    while not beam_of(core, tile, 0, 4096, 0, np.inf).describe()["is_by_film"]:
        tile = random_tile(rng, samples, size)
    origins = np.tile(np.float32(tile.origin), (4096, 1))
    trees = [build(core, scene_ahead(rng, tile, kind)) for kind in (3, 0, 3)]
    # Each follows another one, so that what beams of its own gained or lost is forgotten.
    for tree, beams in zip(trees, (None, 1, 5), strict=True):
        exact = closest(tree, (origins, tile.directions), BRUTE_FORCE)
        t, face, counters = core.beam_leaf_selftest.trace_tile(
            tree, tile.origin, tile.directions, tile.map, tile.square, 0.0, np.inf,
            TRAVERSALS["beam_leaf"],
        )  # fmt: skip
        assert np.array_equal(face.view(np.int32), exact.face), SEED
        assert np.array_equal(t, exact.t), SEED
        assert counters["rays"] == 4096
        if beams is not None:
            assert counters["beams"] == beams
            assert counters["fallbacks"] == (beams > 1)


def scene_ahead(rng: np.random.Generator, tile: Tile, kind: int) -> workloads.Scene:
    directions = np.float64(tile.directions)
    middle = directions.mean(axis=0)
    spread = max(np.abs(directions - middle).max(), 1e-3 * np.linalg.norm(middle))
    triangles = []
    for _ in range(3 if kind == 0 else 12 if kind < 3 else 400):
        depth = rng.uniform(1, 6)
        size = spread * depth * (rng.choice([1, 10, 50]) if kind < 3 else 0.1)
        ahead = directions[rng.integers(len(directions))] * depth
        corners = tile.origin + ahead + rng.uniform(-size, size, (3, 3))
        triangles.append(corners)
        if kind == 2:  # the same once more, and a part of it, in its plane or nearly
            triangles.append(corners[[1, 2, 0]])
            triangles.append(np.array([corners[0], corners.mean(axis=0), corners[2]]))
    vertices = np.float32(np.concatenate(triangles))
    if kind == 3:  # vertices that rays meet
        rays = rng.integers(len(directions), size=len(vertices) // 4)
        vertices[::4][: len(rays)] = np.float32(
            tile.origin + directions[rays] * rng.choice([2.0, 3.0], (len(rays), 1))
        )
    return vertices, np.arange(len(vertices), dtype=np.int32).reshape(-1, 3)
