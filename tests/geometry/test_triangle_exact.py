"""Brute force in the core against exact arithmetic: the hit contract itself."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import oracles
import pytest
import workloads
from tracing import (
    BRUTE_FORCE,
    TRAVERSALS,
    Hits,
    build,
    closest,
    each_core,
    interval,
    occluded,
)

SEED = 424242
SCENES = sorted(workloads.scenes(np.random.default_rng(SEED)))


def assert_exact(found: Hits, expected: list[oracles.Hit | None]) -> None:
    """Asserts the face that the contract chooses and the correctly rounded t."""
    face = [-1 if hit is None else hit.face for hit in expected]
    t = np.array([np.inf if hit is None else hit.t for hit in expected], np.float32)
    wrong = np.flatnonzero((found.face != face) | (found.t != t))
    assert wrong.size == 0, "\n".join(
        [f"{wrong.size} of {len(face)} rays are wrong (seed {SEED}):"]
        + [
            f"ray {i}: {found.face[i]} at {found.t[i]}, not {expected[i]}"
            for i in wrong[:5]
        ]
    )


@each_core
@pytest.mark.parametrize("name", SCENES)
def test_nearest_hits_are_exact(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    rays = workloads.all_rays(rng, scene, 100)
    crossings = list(oracles.Soup(*scene).crossings(*rays))
    expected = oracles.nearest_hits(crossings)
    assert any(expected)
    tree = build(core, scene)
    assert_exact(closest(tree, rays, BRUTE_FORCE), expected)
    hit = [hit is not None for hit in expected]
    np.testing.assert_array_equal(occluded(tree, rays, BRUTE_FORCE), hit)


@each_core
@pytest.mark.parametrize("name", ["soup", "duplicates", "sphere", "stairs"])
def test_intervals_are_open_below_and_closed_above(core: ModuleType, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    rays = workloads.all_rays(rng, scene, 60)
    crossings = list(oracles.Soup(*scene).crossings(*rays))
    tree = build(core, scene)
    nearest = oracles.nearest_hits(crossings)
    t = np.array([1.0 if hit is None else hit.t for hit in nearest], np.float32)
    zero, infinity = np.zeros_like(t), np.full_like(t, np.inf)
    below = np.nextafter(t, zero)
    for t_min, t_max in ((t, infinity), (below, t), (zero, t), (zero, below), (t, t)):
        expected = oracles.nearest_hits(crossings, t_min, t_max)
        assert_exact(closest(tree, rays, BRUTE_FORCE, t_min, t_max), expected)
        hit = [hit is not None for hit in expected]
        np.testing.assert_array_equal(occluded(tree, rays, BRUTE_FORCE, t_min, t_max), hit)


@each_core
def test_barycentric_coordinates_are_those_of_the_exact_hit(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 200, 0.5)
    rays = workloads.into_box(rng, scene, 300)
    found = closest(build(core, scene), rays, BRUTE_FORCE)
    soup = oracles.Soup(*scene)
    hits = np.flatnonzero(found.face >= 0)
    assert hits.size > 100
    for i in hits:
        corners = [soup.points[j] for j in soup.faces[found.face[i]]]
        u, v = oracles.barycentric(
            oracles.to_point(rays[0][i]), oracles.to_point(rays[1][i]), *corners
        )
        assert found.u[i] == pytest.approx(float(u), abs=2e-6)
        assert found.v[i] == pytest.approx(float(v), abs=2e-6)


# A plane whose parameter is the midpoint of two neighbouring floats, or a hair beside it:
# an error bound of double precision cannot tell how to round, and coincident triangles must
# agree whatever the order of their vertices. Counters tell of it whichever way rays go.
@each_core
@pytest.mark.parametrize(("offset", "rounded"), [(0, 1), (1, 1 + 2**-23), (-1, 1)])
def test_distances_are_rounded_correctly_at_midpoints(
    core: ModuleType, offset: int, rounded: float
) -> None:
    corners = np.array([[-3, -2, 1], [5, -2, 1], [-1, 7, 1]], np.float32)
    faces = np.array([[1, 2, 0], [0, 1, 2], [2, 0, 1], [1, 0, 2]], np.uint32)
    start = [0, 0, -(2**-24) * (1 + offset * 2**-22)]  # t = 1 + 2^-24 + offset * 2^-46
    rays = (
        np.tile(np.array(start, np.float32), (20, 1)),
        np.tile(np.array([0, 0, 1], np.float32), (20, 1)),
    )
    tree = build(core, (corners, faces))
    for options in (BRUTE_FORCE, *TRAVERSALS.values()):
        counters: dict[str, int] = {}
        ends = interval(rays, 0, np.inf)
        t, face = tree.closest_hit(*rays, *ends, options, counters)[:2]
        assert set(t) == {np.float32(rounded)}
        assert set(face) == {0}
        assert (counters["exact_distances"] > 0) == (offset == 0), options


# Products of the smallest coordinates and of long directions are far apart: what single
# precision loses to underflow must not be taken for a decision.
@each_core
@pytest.mark.parametrize("common_origin", [False, True])
@pytest.mark.parametrize(
    ("power", "length"), [(-66, 40), (-60, 0), (-20, 0), (30, 0), (30, -40)]
)
def test_scaling_by_powers_of_two_scales_t(
    core: ModuleType, power: int, length: int, common_origin: bool
) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.sphere(2)
    origins = workloads.snap(rng.uniform(-0.3, 0.3, (1500, 3)))
    if common_origin:
        origins[:] = origins[0]
    directions = rng.choice(vertices, 1500) - origins
    size, stretch = np.float32(2.0**power), np.float32(2.0**length)
    plain = closest(build(core, (vertices, faces)), (origins, directions), BRUTE_FORCE)
    tree = build(core, (vertices * size, faces))
    scaled = closest(tree, (origins * size, directions * stretch), BRUTE_FORCE)
    np.testing.assert_array_equal(scaled.face, plain.face)
    np.testing.assert_array_equal(scaled.t, plain.t * (size / stretch))
    assert (plain.face >= 0).all()


@each_core
def test_needles_and_caps_far_from_the_ray_are_missed(core: ModuleType) -> None:
    vertices = np.array(
        [(0, 0, 0), (1, 0, 0), (1, 1e-7, 0), (600, 599, 0), (-600, -599, 0), (0, 1e-5, 0)],
        np.float32,
    )
    faces = np.array([(0, 1, 2), (3, 4, 5)], np.uint32)
    rng = np.random.default_rng(SEED)
    scene = vertices, faces
    rays = workloads.all_rays(rng, scene, 100)
    crossings = list(oracles.Soup(*scene).crossings(*rays))
    expected = oracles.nearest_hits(crossings)
    assert any(expected)
    assert_exact(closest(build(core, scene), rays, BRUTE_FORCE), expected)


# Planes across an axis have a way of their own to the rounded distance.
@each_core
def test_distances_to_planes_across_an_axis_are_exact(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    for axis in range(3):
        height = rng.uniform(500, 600, 40).astype(np.float32)
        corners = rng.uniform(-50, 50, (40, 3, 3)).astype(np.float32)
        corners[:, :, axis] = height[:, None]
        scene = corners.reshape(-1, 3), np.arange(120, dtype=np.uint32).reshape(-1, 3)
        inside = corners.mean(axis=1)
        origins = rng.uniform(-1, 1, (40, 3)).astype(np.float32)
        origins[:, axis] = -800  # differences of 1300 to 1400 fall on midpoints of floats
        directions = (inside - origins).astype(np.float32)
        unit = directions / np.abs(directions[:, [axis]])
        for along in (directions, unit.astype(np.float32), -unit.astype(np.float32)):
            rays = origins, np.ascontiguousarray(along)
            crossings = list(oracles.Soup(*scene).crossings(*rays))
            expected = oracles.nearest_hits(crossings)
            assert_exact(closest(build(core, scene), rays, BRUTE_FORCE), expected)


# Coordinates whose products leave the range of single precision.
@each_core
@pytest.mark.parametrize("common_origin", [False, True])
@pytest.mark.parametrize("power", [40, 55, 62, 64, 70, 90, 110])
def test_huge_coordinates(core: ModuleType, power: int, common_origin: bool) -> None:
    rng = np.random.default_rng(SEED)
    scale = np.float32(2.0**power)
    vertices, faces = workloads.soup(rng, 12, 1.0)
    scene = vertices * scale, faces
    origins = rng.uniform(-1, 2, (200, 3)).astype(np.float32) * scale
    if common_origin:
        origins[:] = origins[0]
    targets = scene[0][rng.integers(0, len(vertices), 200)]
    directions = ((targets - origins) / scale).astype(np.float32)
    rays = origins, directions
    expected = oracles.nearest_hits(list(oracles.Soup(*scene).crossings(*rays)))
    assert any(expected)
    assert_exact(closest(build(core, scene), rays, BRUTE_FORCE), expected)
