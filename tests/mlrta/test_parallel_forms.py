"""What beams of parallel rays keep of triangles: their bounds against exact fractions."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from exact_volumes import lanes, volumes
from tracing import each_core

SEED = 20261129
FloatArray = npt.NDArray[np.float32]
LO, HI = np.full(3, -40, np.float32), np.full(3, 40, np.float32)
# How far directions deviate from each other, relative to their length.
DEVIATIONS = {"exactly parallel": 0.0, "but for rounding": 2.0**-23, "a little": 2.0**-16}


class ExactParallelBeam:
    """A bundle of rays in the coordinates that a beam chose, as fractions."""

    def __init__(self, core: ModuleType, origins: FloatArray, along: FloatArray) -> None:
        self.origins, self.directions = origins, along
        self.beam: Any = core.beam_leaf_selftest.Beam(origins, along, LO, HI)
        told = self.beam.describe()
        self.axes = list(told["axes"])
        self.side = Fraction(told["side"])
        self.origin = [Fraction(x) for x in told["origin"]]
        u, v = map(Fraction, told["common_slopes"])
        # In the order of the coordinates.
        self.along = [Fraction(0)] * 3
        for axis, slope in zip(self.axes, (u, v, self.side), strict=True):
            self.along[axis] = slope
        self.rays: dict[int, tuple[np.float32, np.float32]] = {}
        for n, packet in enumerate(told["packets"]):
            for lane in lanes(packet["active"]):
                self.rays[16 * n + lane] = (
                    np.float32(packet["u"][lane]),
                    np.float32(packet["v"][lane]),
                )

    def of(self, ray: int, triangle: FloatArray) -> tuple[list[Fraction], Fraction | None]:
        """The three edge forms where a ray passes them, and -z where it meets the plane if
        it is ahead."""
        direction = self.directions[ray]
        edges, along, volume = volumes(self.origins[ray], direction, triangle)
        corners = [[Fraction(float(x)) for x in corner] for corner in triangle]
        p, q = (
            [x - y for x, y in zip(corner, corners[0], strict=True)]
            for corner in corners[1:]
        )
        area = sum(
            self.along[k]
            * (p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3])
            for k in range(3)
        )
        k = self.axes[2]
        main = Fraction(float(direction[k]))
        forms = [edge / (abs(main) * area) for edge in edges]
        if along == 0 or volume / along <= 0:
            return forms, None
        start = Fraction(float(self.origins[ray][k])) - self.origin[k]
        return forms, -self.side * (start + volume / along * main)


def bundle(
    core: ModuleType, rng: np.random.Generator, spread: float, deviation: float, count: int
) -> ExactParallelBeam:
    along = rng.normal(0, 1, 3)
    along /= np.linalg.norm(along)
    origins = rng.uniform(-5, 5, 3) + rng.uniform(-spread, spread, (count, 3))
    directions = along + rng.uniform(-deviation, deviation, (count, 3))
    directions *= rng.uniform(0.1, 10, (count, 1))
    return ExactParallelBeam(core, np.float32(origins), np.float32(directions))


def triangles_on_the_way(
    rng: np.random.Generator, exact: ExactParallelBeam, spread: float
) -> FloatArray:
    """Eight triangles (8, 3, 3) that rays go through or pass by, of all shapes."""
    found = []
    for size in (10, 1, 0.3, 0.1):
        for shape in ("any", "sliver"):
            ray = rng.integers(len(exact.origins))
            d = exact.directions[ray].astype(np.float64)
            centre = exact.origins[ray] + d / np.linalg.norm(d) * rng.uniform(0.1, 20)
            corners = centre + spread * rng.uniform(-size, size, (3, 3))
            if shape == "sliver":
                corners[2] = 0.5 * (corners[0] + corners[1])
                corners[2] += rng.uniform(-1e-3, 1e-3, 3) * size * spread
            found.append(corners)
    return np.asarray(found, np.float32)


@each_core
@pytest.mark.parametrize("deviation", DEVIATIONS)
def test_parallel_forms_are_as_near_as_they_say(core: ModuleType, deviation: str) -> None:
    rng = np.random.default_rng(SEED)
    certain = depths = 0
    for spread in (1.0, 0.2, 1.0, 0.2):
        exact = bundle(core, rng, spread, DEVIATIONS[deviation], 64)
        assert len(exact.rays) > 32, SEED
        triangles = triangles_on_the_way(rng, exact, spread)
        told = exact.beam.forms(triangles.reshape(-1, 3))
        for n in lanes(told["possible"]):
            edge_error = Fraction(told["edge_error"][n])
            depth_error = Fraction(told["depth_error"][n])
            assert told["depth_shrink"][n] == told["depth_grow"][n] == 1
            for ray in list(exact.rays)[::7]:
                u, v = exact.rays[ray]
                edges, depth = exact.of(ray, triangles[n])
                values = [
                    Fraction(
                        float(np.float32(of_u[n] * u + np.float32(of_v[n] * v + one[n])))
                    )
                    for one, of_u, of_v in (map(np.float32, form) for form in told["forms"])
                ]
                for value, edge in zip(values[:3], edges, strict=True):
                    # The computed area may be off a little too.
                    assert abs(value - edge) <= edge_error + abs(edge) / 1000, (
                        SEED,
                        n,
                        ray,
                    )
                    if abs(value) > edge_error:
                        assert value * edge > 0, (SEED, n, ray)
                        certain += 1
                if depth is not None and all(edge >= 0 for edge in edges):
                    assert abs(values[3] - depth) <= depth_error, (SEED, n, ray)
                    depths += 1
    assert certain > 400, SEED
    assert depths > 10, SEED


@each_core
@pytest.mark.parametrize("deviation", DEVIATIONS)
def test_no_triangle_that_a_parallel_ray_hits_is_rejected(
    core: ModuleType, deviation: str
) -> None:
    rng = np.random.default_rng(SEED)
    hit = rejected = 0
    for spread in (1.0, 0.3, 0.1) * 2:
        exact = bundle(core, rng, spread, DEVIATIONS[deviation], 80)
        triangles = triangles_on_the_way(rng, exact, spread)
        told = exact.beam.forms(triangles.reshape(-1, 3))
        for n in range(8):
            kept = (told["possible"] | told["unsafe"]) >> n & 1
            by_run = (told["possible_for_runs"][0] | told["unsafe"]) >> n & 1
            rejected += not by_run
            for ray in exact.rays:
                edges, depth = exact.of(ray, triangles[n])
                if depth is not None and all(edge >= 0 for edge in edges) and any(edges):
                    hit += 1
                    assert kept and by_run, (SEED, n, ray)
    assert hit > 20, SEED
    assert rejected > 2, SEED
