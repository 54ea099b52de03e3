"""Directions with zeros, denormal and huge components, and none at all."""

from __future__ import annotations

import itertools
import math

import numpy as np
import workloads
from workloads import Rays

from .case import HardCase, RaySet, along, case, generator, rows, towards, triangles

SIGNS = rows(*(s for s in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(s)))
"""The 26 directions to the neighbours of a cube."""


def signed_zeros(directions: np.ndarray) -> np.ndarray:
    """Each direction once for each choice of signs of its zeros."""
    found = []
    for direction in directions:
        zeros = np.flatnonzero(direction == 0)
        for signs in itertools.product((0.0, -0.0), repeat=len(zeros)):
            changed = direction.copy()
            changed[zeros] = signs
            found.append(changed)
    return np.array(found, np.float32)


@case(7)
def all_patterns_of_signs_and_zeros() -> HardCase:
    """1 / 0 and 1 / -0 are infinities of other signs, and 0 times either is NaN."""
    directions = signed_zeros(SIGNS)
    assert len(directions) == 6 * 4 + 12 * 2 + 8
    rng = generator()
    scene = workloads.soup(rng, 200)
    through = workloads.along_axes(rng, scene, 400)
    shared = scene[0][5] + np.float32([0.5, 0, 0])
    signed = np.where((through[1] == 0) & (rng.random((400, 3)) < 0.5), -0.0, through[1])
    return HardCase(
        scene,
        {
            "from one point": RaySet(along(shared, directions)),
            "from many": RaySet(through),
            "from many, zeros signed": RaySet(along(through[0], signed)),
        },
    )


@case(8)
def components_of_extreme_size() -> HardCase:
    """The reciprocal of the smallest component is infinite, that of the greatest is
    denormal, and products with them leave the range of single precision."""
    tiny, small, huge = 2.0**-149, 1e-38, 1e38
    sizes = (0.0, tiny, -tiny, small, -small, 1.0, huge, -huge)
    directions = rows(*(d for d in itertools.product(sizes, repeat=3) if any(d)))
    rng = generator()
    scene = workloads.box()
    origins = workloads.snap(rng.uniform(-0.9, 0.9, directions.shape))
    across = rows((huge, 0, 0), (0, -huge, 0), (0, 0, small), (tiny, 0, 0))
    # The side of the box is 1 away; 1 / 2^-149 is more than the greatest number: no hit.
    away = [1 / np.float64(np.float32(huge))] * 2 + [
        1 / np.float64(np.float32(small)),
        math.inf,
    ]
    lengths = workloads.extreme_lengths(rng, scene, 300)
    return HardCase(
        scene,
        {
            "from one point": RaySet(along((0.125, -0.25, 0.375), directions)),
            "from many": RaySet(along(origins, directions)),
            "along axes": RaySet(along((0, 0, 0), across), t=away),
            "of many lengths": RaySet(lengths),
        },
    )


@case(9)
def camera_along_an_axis() -> HardCase:
    """Middle rows and columns of pixels lie in the planes of symmetry: directions have
    zeros and the rays meet vertices, edges and split planes head-on."""
    scene = workloads.sphere(2)
    straight = workloads.camera(scene, 0, 17)
    steps = np.linspace(-1, 1, 17)
    y, z = (axis.ravel() for axis in np.meshgrid(steps, steps))
    parallel = np.stack([np.full(289, -3.0), y, z], axis=1)
    return HardCase(
        scene,
        {
            "perspective": RaySet(straight),
            "perspective along y": RaySet(workloads.camera(scene, 1, 17)),
            "parallel": RaySet(along(parallel, (1, 0, 0))),
        },
    )


@case(10)
def tile_whose_middle_column_has_no_x() -> HardCase:
    """The tile's beam has directions of both signs and zero along x, so no slope is known
    there, and the column x = 0 runs through vertices."""
    scene = workloads.stairs()
    column = np.arange(-8, 8) / 16  # one of them is exactly 0
    x, z = (axis.ravel() for axis in np.meshgrid(column, column))
    directions = np.stack([x, np.ones(256), z], axis=1)
    assert (directions[:, 0] == 0).sum() == 16
    # Along planes of the stairs, where they are split.
    shared = (float(scene[0][8, 0]), -3, 0)
    rng = generator()
    apart = np.array(shared) + rng.choice([0, 0.25, 0.5], (256, 3)) * (1, 0, 0)
    return HardCase(
        scene,
        {
            "from one point": RaySet(along(shared, directions)),
            "from many": RaySet(along(apart, directions)),
        },
    )


@case(26)
def direction_of_no_length() -> HardCase:
    """Every plane is at 0 / 0 or infinitely far, and rays beside such a one in its packet
    must not notice."""
    rng = generator()
    scene = workloads.box()
    directions = workloads.snap(rng.uniform(-1, 1, (200, 3)))
    none = np.arange(200) % 3 == 0
    directions[none] = rng.choice([0.0, -0.0], (none.sum(), 3))
    inside = workloads.snap(rng.uniform(-0.9, 0.9, (200, 3)))
    on_side = inside.copy()
    on_side[:, 0] = 1
    zeros = np.zeros((20, 3))
    return HardCase(
        scene,
        {
            "from one point": RaySet(along((0.25, 0.5, 0), directions)),
            "from many": RaySet(along(inside, directions)),
            "on a face": RaySet(along(on_side, directions)),
            "nothing else": RaySet(along(inside[:20], zeros), -1),
        },
    )


@case(36)
def edge_on_the_border_of_a_tile() -> HardCase:
    """The triangle covers all of a tile but for the rays on its border, which may be on the
    triangle's edge or just beside it: it must not be taken to stop them all."""
    # Four tiles of 16 rays in rows, of which column 4 has x = 0 and column 12 x = 1.
    column = np.arange(-4, 12) / 8
    x, y = (axis.ravel() for axis in np.meshgrid(column, column))
    directions = np.stack([x, y, np.ones(256)], axis=1)
    rng = generator()
    # Edges at x = 0, and one float to either side of it.
    beside = np.float32(2.0**-24)
    scene = triangles(
        ((0, -64, 2), (0, 64, 2), (64, 0, 2)),
        ((beside, -64, 1), (beside, 64, 1), (-64, 0, 1)),
        ((-64, -64, 3), (64, -64, 3), (0, 64, 3)),
    )
    apart = workloads.snap(rng.uniform(-1, 1, (256, 3))) * np.float32([1, 1, 0.5])
    return HardCase(
        scene,
        {
            "from one point": RaySet(along((0, 0, 0), directions)),
            "from the side": RaySet(along((-0.5, 0, 0.5), directions)),
            "from many": RaySet(along(apart, directions)),
        },
    )


@case(8)
def distances_that_are_denormal() -> HardCase:
    """Distances are a few times the smallest float, so that surfaces at other depths are
    equally near once that is rounded, and the lowest face counts."""
    vertices, faces = workloads.sphere(2)
    rng = generator()
    # Faces in another order, or the nearest would mostly be the lowest anyway.
    shells = [(vertices * np.float32(r)).astype(np.float32) for r in (0.9, 1.0, 0.95, 1.05)]
    numbers = np.concatenate([faces + i * len(vertices) for i in range(4)])
    size, length = np.float32(2.0**-90), np.float32(2.0**58)
    points = np.concatenate(shells) * size
    targets = rng.choice(points, 60)
    origins = (rng.uniform(-0.3, 0.3, (60, 3)) * size).astype(np.float32)
    shared = (np.float32([0.0625, -0.15, 0.2]) * size).astype(np.float32)
    scene = points, rng.permutation(numbers).astype(np.uint32)
    ends = rng.integers(0, 8, 60) * 2.0**-149

    def lengthened(rays: Rays) -> Rays:
        # Of about 2^58: the scene is 2^-148 of that away.
        return rays[0], (rays[1] / size * length).astype(np.float32)

    apart, common = (
        lengthened(towards(origins, targets)),
        lengthened(towards(shared, targets)),
    )
    return HardCase(
        scene,
        {
            "from one point": RaySet(common, every_ray_hits=True),
            "from many": RaySet(apart, every_ray_hits=True),
            "from one point, with an end": RaySet(common, t_max=ends),
            "from many, with an end": RaySet(apart, t_max=ends),
        },
    )
