"""Scenes far away, large and small, and origins in unusual places."""

from __future__ import annotations

import math

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
)


@case(6)
def origin_on_a_triangle() -> HardCase:
    """The distance is exactly 0, which is not beyond t_min = 0; rounding must not make it a
    little more, and a negative t_min must not let it count."""
    scene = workloads.box()
    steps = np.arange(-7, 8) / 8
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    origins = np.stack([x, y, np.full(225, -1.0)], axis=1)
    shared = (0.25, 0.5, -1)
    targets = np.stack([x, y, np.ones(225)], axis=1)
    outwards = rows((0, 0, -1), (0.5, 0, -1), (-2, 3, -0.125))
    return HardCase(
        scene,
        {
            "across": RaySet(along(origins, (0, 0, 1)), every_ray_hits=True, t=2),
            "across from one point": RaySet(
                towards(shared, targets), every_ray_hits=True, t=1, t_min=-0.0
            ),
            "out": RaySet(along(origins, (0, 0, -1)), -1),
            "out, below zero": RaySet(along(origins, (0, 0, -1)), -1, t_min=-1e-30),
            "out from one point": RaySet(along(shared, outwards), -1, t_min=-math.inf),
            "in the plane": RaySet(along(origins, (1, 0, 0)), t=1 - x, every_ray_hits=True),
        },
    )


@case(12)
def scaled_by_powers_of_two() -> HardCase:
    """At 2^-60 squares are denormal, at 2^60 their squares overflow."""
    vertices, faces = workloads.sphere(2)
    small = (vertices * np.float32(2.0**-60)).astype(np.float32)
    rng = generator()
    origins = (workloads.snap(rng.uniform(-0.3, 0.3, (300, 3))) * 2.0**-60).astype(
        np.float32
    )
    targets = rng.choice(small, 300)
    return HardCase(
        (small, faces),
        {
            "from one point": RaySet(towards(origins[0], targets), every_ray_hits=True),
            "from many": RaySet(towards(origins, targets), every_ray_hits=True),
        },
    )


@case(11)
def far_from_the_origin() -> HardCase:
    """At 10^6 coordinates are multiples of 1/16: triangles of size 1 are warped, and
    products of coordinates have no digit left for them."""
    vertices, faces = workloads.sphere(3)
    far = workloads.moved((vertices * np.float32(8), faces), 1e6)
    rng = generator()
    origins = (1e6 + rng.uniform(-2, 2, (600, 3))).astype(np.float32)
    corners = far[0][rng.choice(faces, 600)].astype(np.float64)
    middles = (corners[:, 0] + corners[:, 1]) / 2
    shared = (1e6 + 0.5, 1e6 - 1.25, 1e6 + 0.0625)
    return HardCase(
        far,
        {
            "from one point": RaySet(towards(shared, far[0]), every_ray_hits=True),
            "at vertices": RaySet(towards(origins, corners[:, 2]), every_ray_hits=True),
            "at edges": RaySet(towards(origins, middles), every_ray_hits=True),
        },
    )


@case(27)
def tiny_details_on_a_huge_triangle() -> HardCase:
    """The triangle is 10^10 times as large as what stands on it: any tolerance that suits
    the one swallows or tears the other."""
    size = 1e7
    floor = quad((-size, -size, 0), (size, -size, 0), (size, size, 0), (-size, size, 0))
    unit, faces = workloads.box()
    detail = (
        (unit * np.float32(0.0005) + np.float32([0, 0, 0.0005])).astype(np.float32),
        faces,
    )
    rng = generator()
    near = rng.uniform(-0.0005, 0.0005, (200, 3)) * (1, 1, 0) + (0, 0, 0.001)
    borders = rng.choice(detail[0], 200) * rng.choice([1.0, 0.999, 1.001], (200, 1))
    borders[:, 2] = 0
    far = rng.uniform(-size / 2, size / 2, (200, 3)) * (1, 1, 0)
    return HardCase(
        joined(floor, detail),
        {
            "at details": RaySet(
                along(np.add(near, (0, 0, 1)), (0, 0, -1)), every_ray_hits=True
            ),
            "at borders": RaySet(towards((0.1, 0.2, 1), borders), every_ray_hits=True),
            "at both": RaySet(
                towards((0.3, -0.2, 2), np.concatenate([near, far])), every_ray_hits=True
            ),
        },
    )


def shells(offset: float) -> HardCase:
    """Spheres of radius 1, 1.00001 and 1.00002 around (offset, offset, offset)."""
    vertices, faces = workloads.sphere(2)
    scene = joined(
        *(
            workloads.moved(((vertices * (1 + i * 1e-5)).astype(np.float32), faces), offset)
            for i in range(3)
        )
    )
    rng = generator()
    middle = np.full(3, offset)
    inside = middle + rng.uniform(-0.3, 0.3, (250, 3))
    outside = rng.normal(size=(250, 3))
    outside = middle + 3 * outside / np.linalg.norm(outside, axis=1, keepdims=True)
    targets = scene[0][rng.integers(0, len(scene[0]), 250)]
    return HardCase(
        scene,
        {
            "out from one point": RaySet(towards(middle, targets), every_ray_hits=True),
            "out": RaySet(towards(inside, targets), every_ray_hits=True),
            "in from one point": RaySet(towards(np.add(middle, (2, 2.5, 3)), targets)),
            "in": RaySet(towards(outside, middle), every_ray_hits=True),
        },
    )


@case(32)
def nested_shells() -> HardCase:
    """The shells are 10^-5 apart, some hundred units in the last place of t."""
    return shells(0)


@case(32)
def nested_shells_far_away() -> HardCase:
    """At 10^3 the shells are less apart than coordinates are, and cross one another."""
    return shells(1e3)


@case(40)
def origins_inside_outside_and_beyond() -> HardCase:
    """The interval in which a ray is in the scene's box begins before the origin, after it,
    or has ended; and the box may be behind."""
    room, faces = workloads.box()
    rng = generator()
    clutter = workloads.soup(rng, 60, 0.4)
    scene = joined((room * np.float32(2), faces), clutter)
    directions = workloads.snap(rng.normal(size=(300, 3)))
    outside = workloads.snap(rng.uniform(3, 6, (300, 3)) * rng.choice([-1, 1], (300, 3)))
    inside = workloads.snap(rng.uniform(-1, 1, (300, 3)))
    return HardCase(
        scene,
        {
            "in the room": RaySet(
                along((0.5, 0.25, -1.5), directions), every_ray_hits=True
            ),
            "amid triangles": RaySet(along(inside, directions), every_ray_hits=True),
            "towards": RaySet(towards(outside, inside), every_ray_hits=True),
            "away": RaySet(along(outside, outside), -1),
            "away from one point": RaySet(along((5, 4, 3), np.abs(directions) + 0.125), -1),
            "past": RaySet(along(outside, directions)),
        },
    )


@case(37)
def end_exactly_on_a_surface() -> HardCase:
    """t_max is the very float that is reported for the surface: it counts there, and one
    float before it does not, so a shadow ray must end short of its light."""
    scene = grid(8)
    rng = generator()
    targets = scene[0][scene[1]].astype(np.float64).mean(axis=1)
    origins = targets + rng.uniform((-1, -1, 0.5), (1, 1, 2), targets.shape)
    apart, shared = towards(origins, targets), towards((0.3, 0.2, 0.7), targets)
    # Exact distances, from the z of the float rays: the plane is z = 0.
    ends = [
        (-r[0][:, 2].astype(np.float64) / r[1][:, 2]).astype(np.float32)
        for r in (apart, shared)
    ]
    numbers = np.arange(len(targets))
    sets = {}
    for name, rays, t in (("many", apart, ends[0]), ("one point", shared, ends[1])):
        before = np.nextafter(t, np.float32(0))
        sets[f"at it from {name}"] = RaySet(rays, numbers, t, t_max=t)
        sets[f"before it from {name}"] = RaySet(rays, -1, math.inf, t_max=before)
        sets[f"from it from {name}"] = RaySet(rays, -1, math.inf, t_min=t)
        sets[f"just before it from {name}"] = RaySet(
            rays, numbers, t, t_min=before, t_max=t
        )
    return HardCase(scene, sets)
