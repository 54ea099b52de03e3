"""Shadow rays from a light, in beams of up to 4096 where they meet next to nothing."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import BRUTE_FORCE, build, each_core, occluded

from mlrt_plugin.threads import thread_count

SEED = 20_261_129
SIDE = 64
COUNT = SIDE * SIDE
LARGE = 1024
"""Rays of a beam that is not of the largest ones; see beam_tracer.h."""
END = 1 - 1e-4

FloatArray = npt.NDArray[np.float32]


def receivers(rng: np.random.Generator, tiles: int) -> FloatArray:
    """Points on a floor, in squares side by side, each as a camera sees it."""
    codes = np.arange(COUNT)
    column, row = (
        sum(((codes >> (2 * bit + axis)) & 1) << bit for bit in range(6)) for axis in (0, 1)
    )
    points = []
    for tile in range(tiles):
        place = np.stack([column, row], 1) + rng.uniform(0, 1, (COUNT, 2))
        place = place / SIDE * 0.1 + [0.1 * tile, 0]
        points.append(np.column_stack([place, np.zeros(COUNT)]))
    return np.concatenate(points)


def lit_floor(
    rng: np.random.Generator, occluders: int, tiles: int
) -> tuple[workloads.Scene, workloads.Rays]:
    """Small triangles between a light and a floor, and rays to points of that."""
    light = np.array([0.3, 0.2, 2.0])
    points = receivers(rng, tiles)
    on_the_way = points[rng.integers(len(points), size=occluders)]
    centres = light + (on_the_way - light) * rng.uniform(0.3, 0.9, (occluders, 1))
    corners = centres[:, None] + rng.uniform(-0.01, 0.01, (occluders, 3, 3))
    floor = [[[-1, -1, 0], [3, -1, 0], [-1, 3, 0]]]
    vertices = np.concatenate([floor, corners]).reshape(-1, 3).astype(np.float32)
    faces = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    origins = np.broadcast_to(light.astype(np.float32), points.shape)
    directions = (points - light).astype(np.float32)
    return (vertices, faces), (np.ascontiguousarray(origins), directions)


def beams_of(tree: object, rays: workloads.Rays, traversal: str) -> dict[str, int]:
    """Counters of a run."""
    counters: dict[str, int] = {}
    t_min, t_max = (np.full(len(rays[0]), t, np.float32) for t in (1e-4, END))
    tree.any_hit(*rays, t_min, t_max, {"traversal": traversal}, counters)  # type: ignore[attr-defined]
    return counters


@each_core
@pytest.mark.parametrize("traversal", ["beam_leaf", "adaptive"])
@pytest.mark.parametrize("occluders", [0, 3, 30, 300, 2000])
def test_they_find_what_brute_force_finds(
    core: ModuleType, traversal: str, occluders: int
) -> None:
    print("seed", SEED)
    scene, rays = lit_floor(np.random.default_rng(SEED), occluders, 4)
    tree = build(core, scene)
    expected = occluded(tree, rays, BRUTE_FORCE, 1e-4, END)
    assert np.any(expected) == (occluders > 0)
    found = occluded(tree, rays, {"traversal": traversal}, 1e-4, END)
    assert np.array_equal(found, expected)


@each_core
def test_few_beams_are_enough_for_a_free_floor(core: ModuleType) -> None:
    scene, rays = lit_floor(np.random.default_rng(SEED), 2, 4)
    counters = beams_of(build(core, scene), rays, "adaptive")
    assert 0 < counters["beams"] <= 2 * len(rays[0]) // COUNT
    assert counters["rays"] == len(rays[0])


@each_core
def test_nothing_is_remembered_of_a_tree_that_is_gone(core: ModuleType) -> None:
    """New trees mostly lie where others did that are gone."""
    free, covered = (lit_floor(np.random.default_rng(SEED), n, 4) for n in (2, 2000))
    with thread_count(1):
        first = beams_of(build(core, free[0]), free[1], "adaptive")
        for _ in range(10):
            for _ in range(3):
                beams_of(build(core, covered[0]), covered[1], "adaptive")
            assert beams_of(build(core, free[0]), free[1], "adaptive") == first


@each_core
def test_rays_are_counted_once_if_the_largest_beams_are_divided(core: ModuleType) -> None:
    scene, rays = lit_floor(np.random.default_rng(SEED), 2000, 4)
    counters = beams_of(build(core, scene), rays, "beam_leaf")
    assert counters["beams"] >= len(rays[0]) // LARGE
    assert counters["rays"] == len(rays[0])


@each_core
@pytest.mark.parametrize("traversal", ["beam_leaf", "adaptive"])
def test_rays_that_go_elsewhere(core: ModuleType, traversal: str) -> None:
    """Some of them do not go along with the beam, are no rays at all, or end at once."""
    print("seed", SEED)
    rng = np.random.default_rng(SEED)
    scene, (origins, directions) = lit_floor(rng, 20, 2)
    chosen = rng.permutation(len(directions))[:300]
    directions[chosen[:100]] *= np.float32([1, 1, -1])
    directions[chosen[100:200]] = rng.normal(size=(100, 3))
    directions[chosen[200:220]] = np.nan
    directions[chosen[220:240]] = 0
    t_max = np.full(len(directions), END, np.float32)
    t_max[chosen[240:]] = 0
    tree = build(core, scene)
    rays = origins, directions
    expected = occluded(tree, rays, BRUTE_FORCE, 1e-4, t_max)
    found = occluded(tree, rays, {"traversal": traversal}, 1e-4, t_max)
    assert np.array_equal(found, expected)


@each_core
@pytest.mark.parametrize(("specks", "given_up"), [(300, False), (800, True)])
def test_beams_beside_the_wide_tree_are_given_up_soon(
    core: ModuleType, specks: int, given_up: bool
) -> None:
    """A beam of 256 rays among specks that stop none of them may be tested against 64
    triangles and 1.2 for each ray, and what it is tested against at a time."""
    rng = np.random.default_rng(SEED)
    at = np.arange(256)
    column, row = (sum((at >> 2 * k + i & 1) << k for k in range(4)) for i in (0, 1))
    directions = np.stack([column - 7.5, row - 7.5, np.full(256, 320)], 1) / 80
    rays = np.zeros((256, 3), np.float32), directions.astype(np.float32)
    inside = np.column_stack([rng.uniform(-0.1, 0.1, (specks, 2)), np.full(specks, 4)])
    centres = inside * rng.uniform(0.3, 0.9, (specks, 1))
    corners = centres[:, None] + rng.uniform(-5e-4, 5e-4, (specks, 3, 3))
    faces = np.arange(3 * specks, dtype=np.uint32).reshape(-1, 3)
    tree = build(core, (corners.reshape(-1, 3).astype(np.float32), faces))
    tree.widen()
    most = 64 + 1.2 * len(directions)
    met = beams_of(tree, rays, "beam_leaf")["beam_triangles"]
    assert (most < met < 3 * len(directions)) == given_up, f"seed {SEED}"
    counters = beams_of(tree, rays, "adaptive")
    assert counters["beams"] == 1
    assert counters["fallbacks"] == given_up
    assert counters["beam_triangles"] < most + 32
    expected = occluded(tree, rays, BRUTE_FORCE, 1e-4, END)
    found = occluded(tree, rays, {"traversal": "adaptive"}, 1e-4, END)
    assert np.array_equal(found, expected)
