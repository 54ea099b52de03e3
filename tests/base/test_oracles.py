"""The oracle itself, against double precision, NumPy's rounding and cases done by hand."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import oracles
import pytest
import workloads

SEED = 20260101


def test_rounding_agrees_with_numpy_on_doubles() -> None:
    rng = np.random.default_rng(SEED)
    bits = rng.integers(0, 2**63, 3000, dtype=np.uint64) | rng.integers(0, 2, 3000).astype(
        np.uint64
    ) << np.uint64(63)
    doubles = bits.view(np.float64)
    spread = rng.normal(size=3000) * 2.0 ** rng.uniform(-155, 130, 3000)
    special = [
        0.0,
        2.0**-149,
        2.0**-150,
        1.5 * 2.0**-149,
        2.0**-126,
        2.0**128,
        -(2.0**-151),
    ]
    with np.errstate(over="ignore", under="ignore"):
        for value in (*doubles[np.isfinite(doubles)], *spread, *special):
            expected = np.float32(value)
            assert oracles.round_to_float32(Fraction(float(value))) == expected, value


def test_rounding_takes_ties_to_even_and_does_not_round_twice() -> None:
    ulp = Fraction(1, 2**23)
    tiny = Fraction(1, 2**80)
    for steps in (0, 1, 2, 3):
        middle = 1 + (steps + Fraction(1, 2)) * ulp
        even = 1 + (steps + steps % 2) * ulp
        assert oracles.round_to_float32(middle) == np.float32(float(even))
        # A double would round these to the middle first.
        assert oracles.round_to_float32(middle - tiny) == np.float32(float(1 + steps * ulp))
        assert oracles.round_to_float32(middle + tiny) == np.float32(
            float(1 + (steps + 1) * ulp)
        )
    largest = Fraction(2) ** 128 - Fraction(2) ** 104
    half = Fraction(2) ** 103
    assert oracles.round_to_float32(largest + half - tiny) == np.finfo(np.float32).max
    assert oracles.round_to_float32(largest + half) == math.inf
    assert oracles.round_to_float32(-largest - half) == -math.inf


A, B, C = (0, 0, 0), (1, 0, 0), (0, 1, 0)


@pytest.mark.parametrize(
    ("target", "hit"),
    [
        ((0.25, 0.25), True),
        ((0, 0), True),
        ((1, 0), True),
        ((0, 1), True),
        ((0.5, 0.5), True),
        ((0.5, 0), True),
        ((np.nextafter(np.float32(0.5), np.float32(1)), 0.5), False),
        ((-(2.0**-149), 0), False),
        ((2.0**-149, 0), True),
    ],
)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_triangles_are_closed(target: tuple[float, float], hit: bool, side: float) -> None:
    points = [oracles.to_point(p) for p in ((*target, side), (0, 0, -side), A, B, C)]
    expected = Fraction(1) if hit else None
    assert oracles.meet(*points) == expected


def test_rays_in_the_plane_and_triangles_without_area_are_missed() -> None:
    origin, direction = oracles.to_point((-1, 0.25, 0)), oracles.to_point((1, 0, 0))
    a, b, c = (oracles.to_point(p) for p in (A, B, C))
    assert oracles.meet(origin, direction, a, b, c) is None
    below, up = oracles.to_point((0.25, 0, -1)), oracles.to_point((0, 0, 1))
    assert oracles.meet(below, up, a, b, b) is None
    assert oracles.meet(below, up, a, b, oracles.to_point((0.5, 0, 0))) is None


def test_ties_interval_and_bad_rays() -> None:
    vertices = np.array([A, B, C, (0, 0, 1), (1, 0, 1), (0, 1, 1)], np.float32)
    soup = oracles.Soup(vertices, [(3, 4, 5), (0, 1, 2), (2, 0, 1), (0, 0, 1)])
    down = ((0.25, 0.25, 2), (0, 0, -1))

    def nearest(t_min: float, t_max: float) -> tuple[float, tuple[int, ...]] | None:
        (hit,) = soup.hits([down[0]], [down[1]], t_min, t_max)
        return None if hit is None else (float(hit.t), hit.faces)

    assert nearest(0, math.inf) == (1.0, (0,))
    assert nearest(0, 1) == (1.0, (0,))
    assert nearest(0, np.nextafter(np.float32(1), np.float32(0))) is None
    assert nearest(1, math.inf) == (2.0, (1, 2))
    assert nearest(2, math.inf) is None
    bad = [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, 0)]
    assert soup.hits([down[0]] * 3, bad) == [None] * 3


@pytest.mark.parametrize("name", ["soup", "sphere", "far sphere", "slivers"])
def test_prefilter_drops_nothing_and_most_pairs(name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    soup = oracles.Soup(*scene)
    origins, directions = workloads.all_rays(rng, scene, 5)
    possible = soup.candidates(origins, directions)
    assert possible.mean() < 0.3
    for i, row in enumerate(possible):
        for face in np.flatnonzero(~row):
            assert soup.meet(origins[i], directions[i], int(face)) is None


def test_agrees_with_double_precision_where_that_is_safe() -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 200)
    origins, directions = workloads.into_box(rng, scene, 500)
    t, face = oracles.double_hits(*scene, origins, directions)
    crossings = list(oracles.Soup(*scene).crossings(origins, directions))
    hits = oracles.nearest_hits(crossings)
    assert [-1 if hit is None else hit.face for hit in hits] == face.tolist()
    for i, hit in enumerate(hits):
        if hit is not None:
            exact = min(crossing.exact for crossing in crossings[i] if crossing.exact > 0)
            assert t[i] == pytest.approx(float(exact), rel=1e-12)
    assert (face >= 0).mean() > 0.3


@pytest.mark.parametrize(
    ("direction", "t_max", "meets"),
    [
        ((1, 0, 0), 1.0, True),
        ((1, 0, 0), 0.999, False),
        ((-1, 0, 0), math.inf, False),
        ((1, 1, 0), math.inf, True),
        ((1, np.nextafter(np.float32(1), np.float32(2)), 0), math.inf, False),
        ((0, 0, 1), math.inf, False),
    ],
)
def test_boxes_are_closed(direction: tuple[float, ...], t_max: float, meets: bool) -> None:
    assert (
        oracles.segment_meets_box((0, 0, 0), direction, t_max, (1, 0, 0), (2, 1, 1))
        is meets
    )
