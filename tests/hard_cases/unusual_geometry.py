"""Triangles that coincide, are many in one place, lie in one plane, or are none at all."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import workloads

from .case import (
    HardCase,
    RaySet,
    along,
    case,
    generator,
    grid,
    joined,
    quad,
    rows,
    towards,
    triangles,
)

TRIANGLE = ((-1.0, -1.0, 0.0), (1.0, -1.0, 0.0), (0.0, 1.0, 0.0))


def middle_rays(count: int = 100) -> dict[str, RaySet]:
    """Rays down at points of TRIANGLE, off its edges."""
    rng = generator()
    weights = rng.dirichlet((2, 2, 2), count)
    targets = weights @ np.array(TRIANGLE)
    upright = np.add(targets, (0, 0, 2))
    return {
        "from one point": RaySet(towards((0.25, 0.125, 3), targets), every_ray_hits=True),
        "from many": RaySet(towards(upright, targets), every_ray_hits=True),
        "one many times": RaySet(
            along([(0.125, 0, 2)] * 20, (0, 0, -1)), every_ray_hits=True
        ),
        "from below": RaySet(
            towards(np.subtract(targets, (0, 0, 2)), targets), every_ray_hits=True
        ),
    }


@case(17)
def two_coincident_quads() -> HardCase:
    """Both are hit at exactly the same distance, and the answer must not hang on the order
    in which leaves or lanes come to them."""
    corners = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    around = grid(4, 0)
    # Face 3 of the second is face 1 of the first with its vertices in another order.
    scene = joined(quad(*corners), quad(*corners[2:], *corners[:2]), around)
    rng = generator()
    targets = np.insert(rng.uniform(-0.9, 0.9, (200, 2)), 2, 0, axis=1).astype(np.float32)
    # Face 0 has x >= y, face 1 has x <= y.
    lowest = np.where(targets[:, 0] >= targets[:, 1], 0, 1)
    upright = targets + rng.choice([-1, 1], (200, 1)) * np.float32([0, 0, 1])
    down = RaySet(along(upright, (targets - upright) * np.float32(0.5)), lowest, 2)
    return HardCase(
        scene,
        {"from one point": RaySet(towards((0.5, 0.1, 3), targets)), "upright": down},
    )


@case(18)
def a_thousand_times_the_same_triangle() -> HardCase:
    """No plane separates them, so splitting gains nothing however often it is done."""
    vertices, faces = triangles(TRIANGLE)
    scene = vertices, np.repeat(faces, 1000, axis=0)

    def bounded(report: dict[str, Any]) -> None:
        # Around them there may be empty leaves; bins do not show that splitting is vain.
        if report["builder"] == "exact":
            assert report["leaves"] - report["empty_leaves"] == 1, report
        assert report["references"] <= 8 * 1000, report

    sets = {
        name: RaySet(rays.rays, 0, every_ray_hits=True)
        for name, rays in middle_rays(24).items()
    }
    return HardCase(scene, sets, tree=bounded)


@case(19)
def rosette_around_one_point() -> HardCase:
    """All triangles share a vertex: wherever a cell with it is split, all are on both
    sides."""
    rng = generator()
    count = 400
    way = rng.normal(size=(count, 3))
    first = way / np.linalg.norm(way, axis=1, keepdims=True)
    second = first + 0.2 * rng.normal(size=(count, 3))
    corners = np.stack([np.zeros((count, 3)), first, second], axis=1).astype(np.float32)
    scene = corners.reshape(-1, 3), np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)

    def bounded(report: dict[str, Any]) -> None:
        assert report["references"] <= 40 * count, report

    outside = workloads.snap(3 * rng.permutation(first)[:150])
    return HardCase(
        scene,
        {
            "at the point": RaySet(
                towards(outside[:20], np.zeros((20, 3))), every_ray_hits=True
            ),
            "from one point": RaySet(towards((2, 1, 0.5), rng.permutation(second)[:150])),
            "from the point": RaySet(along((0, 0, 0), rng.permutation(first)[:150])),
            "at others": RaySet(towards(outside, rng.permutation(first)[:150])),
        },
        tree=bounded,
    )


@case(20)
def scene_without_volume() -> HardCase:
    """All z are 0: areas and volumes that the cost of splitting is divided by vanish."""
    scene = workloads.flat(generator())

    def finite(report: dict[str, Any]) -> None:
        # A lazy tree does not know yet.
        assert math.isfinite(report["sah_cost"]) or report["unbuilt_cells"] > 0, report

    rng = generator()
    origins, directions = workloads.into_box(rng, scene, 200)
    inside = origins * np.float32([0.1, 0.1, 0])
    return HardCase(
        scene,
        {
            "oblique from one point": RaySet(towards((3, 2, 1), origins + directions)),
            "oblique": RaySet((origins, directions)),
            "upright": RaySet(along(inside + np.float32([0, 0, 1]), (0, 0, -1))),
            "in the plane": RaySet(along(inside, directions * np.float32([1, 1, 0])), -1),
        },
        tree=finite,
    )


@case(21)
def single_triangle() -> HardCase:
    """The root is a leaf, and its box has no height."""
    return HardCase(triangles(TRIANGLE), middle_rays())


@case(21)
def two_triangles() -> HardCase:
    """The one plane that can separate them touches both."""
    beside = ((1.0, -1.0, 0.0), (3.0, -1.0, 0.0), (2.0, 1.0, 0.0))
    border = RaySet(along([(1, -1, 1), (1, -1, -1)], [(0, 0, -1), (0, 0, 1)]), 0, 1)
    return HardCase(
        triangles(TRIANGLE, beside), {**middle_rays(), "where they touch": border}
    )


@case(21)
def empty_scene() -> HardCase:
    """There is no box to clip to."""
    nothing = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)
    rays = {
        name: RaySet(found.rays, -1, math.inf) for name, found in middle_rays(40).items()
    }
    return HardCase(nothing, rays)


@case(23)
def staircase_with_double_faces() -> HardCase:
    """Boxes share whole faces, so at each step two faces of opposite orientation are at
    the same distance, of which the lower number counts."""
    scene = workloads.stairs()
    rng = generator()
    lo, hi = scene[0].min(axis=0), scene[0].max(axis=0)
    heights = rng.uniform(lo, hi, (200, 3))
    rightwards = heights * (0, 1, 1) + (float(lo[0]) - 1, 0, 0)
    return HardCase(
        scene,
        {
            "along x": RaySet(along(rightwards, (1, 0, 0))),
            "back": RaySet(along(np.add(rightwards, (20, 0, 0)), (-1, 0, 0))),
            "through": RaySet(along(heights, rng.choice([-1, 0, 1], (200, 3)))),
            "from one point": RaySet(towards((-2, 0.03, 0.3), heights)),
        },
    )


@case(25)
def values_that_are_not_finite() -> HardCase:
    """A NaN that gets into a box or a packet makes comparisons false for all the others."""
    rng = generator()
    vertices, faces = workloads.soup(rng, 120, 0.6)
    vertices[[4, 100, 200], [0, 1, 2]] = np.nan, np.inf, -np.inf
    rays = workloads.into_box(rng, workloads.soup(rng, 120, 0.6), 300)
    origins, directions = rays[0].copy(), rays[1].copy()
    bad = np.arange(300) % 4 == 1
    origins[bad, rng.integers(0, 3, bad.sum())] = rng.choice([np.nan, np.inf], bad.sum())
    worse = np.arange(300) % 4 == 2
    directions[worse, rng.integers(0, 3, worse.sum())] = rng.choice(
        [np.nan, np.inf, -np.inf], worse.sum()
    )
    shared = np.float32([0.25, -2.5, 0.125])
    broken = rays[0] + rays[1] - shared
    broken[worse] = directions[worse]

    def three_dropped(report: dict[str, Any]) -> None:
        assert report["dropped_triangles"] == 3, report

    return HardCase(
        (vertices, faces),
        {
            "all finite": RaySet(rays),
            "some not": RaySet((origins, directions)),
            "from one point": RaySet(along(shared, broken)),
            "from nowhere": RaySet(along((np.nan, 0, 0), rays[1]), -1),
            "nowhere else": RaySet(along(rays[0], rows((np.inf, 0, 0))), -1),
        },
        tree=three_dropped,
    )
