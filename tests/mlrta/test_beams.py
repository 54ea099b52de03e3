"""A beam contains every ray it was made for: exactly, in fractions."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any

import beams
import numpy as np
import pytest
from tracing import each_core

SEED = 1887


def assert_contains(beam: Any, origin: Any, direction: Any, t_max: float) -> None:
    """Asserts the bounds of a beam for one ray of float32 components."""
    o = [Fraction(float(x)) for x in origin]
    d = [Fraction(float(x)) for x in direction]
    assert t_max <= beam.t_max
    for k in range(3):
        assert beam.origin[k][0] <= o[k] <= beam.origin[k][1]
        heading = beam.heading[k]
        if heading == 0:
            continue
        assert d[k] * heading > 0
        low, high = beam.reciprocal(k)
        assert low <= 1 / d[k] <= high
        for j in {0, 1, 2} - {k}:
            low, high = beam.slope(k, j)
            assert low <= d[j] / d[k] <= high, (k, j)
    if beam.has_planes:
        for normal in beam.plane_normals:
            n = [Fraction(x) for x in normal]
            inside = sum(x * y for x, y in zip(n, d, strict=True))
            scale = sum(abs(x) for x in n) * max(abs(x) for x in d)
            assert inside >= -Fraction(beam.plane_slack) * scale


@each_core
@pytest.mark.parametrize("common_origin", [True, False])
def test_beams_of_rays(core: ModuleType, common_origin: bool) -> None:
    rng = np.random.default_rng(SEED)
    some_heading = 0
    for _ in range(150):
        origins, directions = beams.bundle(rng, 20, common_origin)
        t_max = rng.uniform(0.1, 10, 20).astype(np.float32)
        t_min = np.zeros(20, np.float32)
        beam = core.mlrta_selftest.ray_beam(
            origins, directions, t_min, t_max, common_origin
        )
        for ray in zip(origins, directions, t_max, strict=True):
            assert_contains(beam, *ray)
        some_heading += any(beam.heading)
    assert some_heading > 50


@each_core
def test_inactive_rays_do_not_widen_a_beam(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    origins, directions = beams.bundle(rng, 16, False, spread=0.01)
    t_min, t_max = np.zeros(16, np.float32), np.ones(16, np.float32)
    narrow = core.mlrta_selftest.ray_beam(
        origins[:8], directions[:8], t_min[:8], t_max[:8], False
    )
    directions[8:] = -directions[8:] * 7
    origins[8:] += 5
    t_max[8:12], t_min[12:] = 0, 1
    beam = core.mlrta_selftest.ray_beam(origins, directions, t_min, t_max, False)
    assert (beam.heading, beam.origin) == (narrow.heading, narrow.origin)
    assert beam.t_max == narrow.t_max
    for k in range(3):
        assert narrow.heading[k] == 0 or beam.reciprocal(k) == narrow.reciprocal(k)


def camera(rng: np.random.Generator) -> tuple[Any, Any, Any, Any]:
    """Returns origin, base, dx and dy of a film of about 64 x 64 pixels, in float32."""
    frame = np.roll(np.eye(3), rng.integers(3), axis=0)
    if rng.random() < 0.6:
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    width = rng.choice([0.01, 0.5, 2.0])
    base = frame[2] - (frame[0] + frame[1]) * width / 2
    rows = rng.normal(size=3), base, frame[0] * width / 64, frame[1] * width / 64
    origin, base, dx, dy = (tuple(map(float, np.float32(row))) for row in rows)
    return origin, base, dx, dy


def film_direction(base: Any, dx: Any, dy: Any, x: np.float32, y: np.float32) -> Any:
    """Returns the direction of a point of the film as the renderer rounds it."""
    b, u, v = (np.asarray(row, np.float32) for row in (base, dx, dy))
    return (b + x * u) + y * v


@each_core
def test_beams_of_a_camera(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    headings = 0
    for _ in range(150):
        origin, base, dx, dy = camera(rng)
        x0, y0 = rng.integers(0, 60, 2)
        size = int(rng.choice([1, 4, 33]))
        film = (float(x0), float(x0 + size), float(y0), float(y0 + size))
        beam = core.mlrta_selftest.camera_beam(origin, base, dx, dy, *film, np.inf)
        x = np.float32(x0 + size * rng.choice([0, 0.5, 1, rng.random()], 25))
        y = np.float32(y0 + size * rng.choice([0, 0.5, 1, rng.random()], 25))
        for point in zip(x, y, strict=True):
            direction = film_direction(base, dx, dy, *point)
            assert_contains(beam, np.float32(origin), direction, np.inf)
        headings += sum(map(abs, beam.heading))
    assert headings > 150


@each_core
def test_points_of_a_camera_s_rays_are_kept(core: ModuleType) -> None:
    """Rays through a tile's border miss its exact beam by the rounding of directions."""
    rng = np.random.default_rng(SEED)
    selftest = core.mlrta_selftest
    tests = ("may_enter_by_planes", "may_enter_by_slopes", "may_enter_by_parameters")
    for _ in range(100):
        _, base, dx, dy = camera(rng)
        x0, y0 = map(float, rng.integers(0, 60, 2))
        film = (x0, x0 + 4, y0, y0 + 4)
        beam = selftest.camera_beam((0, 0, 0), base, dx, dy, *film, np.inf)
        for offset in rng.choice([0, 0.5, 4], (8, 2)):
            point = film_direction(base, dx, dy, *np.float32(np.add((x0, y0), offset)))
            cell = tuple(map(float, point)), tuple(map(float, point))
            for test in tests:
                assert getattr(selftest, test)(beam, *cell), (SEED, film, offset, test)


@each_core
@pytest.mark.parametrize("samples", [1, 3])
def test_beams_of_runs_of_a_tile(core: ModuleType, samples: int) -> None:
    rng = np.random.default_rng(SEED)
    origin, base, dx, dy = camera(rng)
    tile = (16, 32, 8, samples)
    tile_beam = core.mlrta_selftest.tile_beam
    for pixels in (64, 32, 16, 4, 2, 1):
        for first in range(0, 64, pixels):
            run = first * samples, pixels * samples
            beam = tile_beam(origin, base, dx, dy, tile, *run, np.inf)
            assert beam is not None
            for pixel in range(first, first + pixels):
                x = 16 + sum((pixel >> 2 * bit & 1) << bit for bit in range(3))
                y = 32 + sum((pixel >> 2 * bit + 1 & 1) << bit for bit in range(3))
                for offset in (rng.random(2), (0, 0), (1, 1)):
                    point = np.float32((x + offset[0], y + offset[1]))
                    direction = film_direction(base, dx, dy, *point)
                    assert_contains(beam, np.float32(origin), direction, np.inf)
    for run in ((samples, 2 * samples), (0, 3 * samples)):
        assert tile_beam(origin, base, dx, dy, tile, *run, np.inf) is None
