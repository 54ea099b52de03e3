"""Rays, origins and triangles exactly in the planes that split the tree."""

from __future__ import annotations

import itertools

import numpy as np
import workloads
from kd_trees import BuiltTree

from .case import (
    HardCase,
    RaySet,
    Scene,
    along,
    case,
    generator,
    grid,
    joined,
    rows,
    towards,
    triangles,
)

TOUCHED = (0.0, 0.0, 0.0)
"""Where the eight cells of `octants` meet."""


def splits(scene: Scene, axis: int) -> list[float]:
    """Positions of the exact builder's split planes across an axis."""
    tree = BuiltTree(scene[0][scene[1]], builder="exact")
    return sorted({float(split) for split in tree.split[tree.axis == axis]})


def walled(axis: int = 2) -> Scene:
    """A tessellated square in {x[axis] = 0}, which the tree splits at, amid two others."""
    lower, upper = grid(2, axis, -1.5, 1.5), grid(2, axis, -1.5, 1.5)
    lower[0][:, axis] = -1
    upper[0][:, axis] = 1
    scene = joined(grid(8, axis), lower, upper)
    assert 0 in splits(scene, axis), "the square is not in a split plane"
    return scene


OCTANTS = tuple(itertools.product((-1, 1), repeat=3))


def octants(*, without: tuple[int, int, int] | None = None) -> Scene:
    """Eight boxes, one in each octant, that all have a corner in the origin; or all but
    one."""
    unit, faces = workloads.box()
    boxes = [
        (((unit + np.float32(1)) * np.float32(0.5) * sign).astype(np.float32), faces)
        for sign in OCTANTS
        if sign != without
    ]
    scene = joined(*boxes)
    for axis in range(3):
        assert 0 in splits(scene, axis), f"no cell ends at 0 along axis {axis}"
    return scene


@case(4)
def ray_in_the_plane_of_a_quad_that_splits() -> HardCase:
    """The plane's parameter is 0 / 0 for the ray, so neither child may be left out, and the
    quad itself is never hit."""
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(240)], axis=1)
    rng = generator()
    inside = rng.uniform(-1, 1, (240, 3))
    inside[:, 2] = 0
    tilted = around + rng.choice([0, 1e-7, -1e-7, 0.25], (240, 1)) * np.eye(3)[2]
    return HardCase(
        walled(),
        {
            "in the plane from one point": RaySet(along((0.03, 0.1, 0), around), -1),
            "in the plane from many": RaySet(along(inside, around), -1),
            "tilted from one point": RaySet(along((-0.3, -0.2, 0), tilted)),
            "tilted from many": RaySet(along(inside, tilted)),
        },
    )


@case(5)
def origin_on_a_split_plane() -> HardCase:
    """The origin is on both sides of the plane, and the side to start with hangs on the
    direction, which may be none."""
    scene = workloads.stairs()
    rng = generator()
    origins, directions = [], []
    for axis in range(3):
        for position in splits(scene, axis):
            origin = rng.uniform(-1, 1, (12, 3))
            origin[:, axis] = position
            direction = np.where(rng.random((12, 3)) < 0.5, 0, rng.uniform(-1, 1, (12, 3)))
            direction[:6, axis] = 0
            direction[:6, axis - 1] = 1
            direction[6:9] = np.eye(3)[axis]
            direction[9:] = -np.eye(3)[axis]
            origins.append(origin)
            directions.append(direction)
    corner = [
        position[len(position) // 2] for position in (splits(scene, k) for k in range(3))
    ]
    return HardCase(
        scene,
        {
            "from one point": RaySet(along(corner, np.concatenate(directions))),
            "from many": RaySet(along(np.concatenate(origins), np.concatenate(directions))),
        },
    )


@case(22)
def triangles_in_faces_of_cells() -> HardCase:
    """Rule 2 gives a triangle in a cell's face to one cell only: it must be hit by rays
    that come from the other."""
    scene = walled()
    count = len(grid(8)[1])
    # Off all edges: one triangle is hit, that whose middle it is.
    targets = scene[0][scene[1][:count]].astype(np.float64).mean(axis=1)
    numbers = np.arange(count)
    sets = {}
    for side, name in ((0.5, "above"), (-0.5, "below")):
        apart = np.add(targets, (0.25, -0.125, side))
        sets[f"from one point {name}"] = RaySet(towards((0.1, 0.2, side), targets), numbers)
        sets[f"from many {name}"] = RaySet(towards(apart, targets), numbers)
    return HardCase(scene, sets)


@case(29)
def triangle_that_touches_a_cell_in_a_corner() -> HardCase:
    """Clipped to the cell the triangle is a point, of no area and no extent, and the
    reference to it must be kept."""
    # The first vertex is where eight cells meet; the rest is in the first octant.
    touching = triangles((TOUCHED, (0.5, 0.25, 0.375), (0.25, 0.5, 0.125)))
    scene = joined(touching, octants(without=(-1, -1, -1)))
    rng = generator()
    origins = workloads.snap(-rng.uniform(1, 4, (200, 3)))
    return HardCase(
        scene,
        {
            # From the octant opposite: of all that is hit in the point, it is the first.
            "from one point": RaySet(towards((-3, -2, -1.5), [TOUCHED] * 20), 0, 1),
            "from many": RaySet(towards(origins, TOUCHED), 0, 1),
            "by the plane's side": RaySet(towards(rows((1, -1, 0.5), (-1, 2, 1)), TOUCHED)),
        },
    )


@case(30)
def along_the_edge_of_a_cell() -> HardCase:
    """The ray goes through the line that two split planes have in common, where it enters
    both cells behind at the same parameter."""
    heights = np.linspace(-0.9, 0.9, 61)
    on_edge = np.stack([np.zeros(61), np.zeros(61), heights], axis=1)
    spread = np.concatenate([on_edge, on_edge[:, [2, 0, 1]], on_edge[:, [1, 2, 0]]])
    signs = list(itertools.product((-1.0, 1.0), repeat=2))
    origins, targets = [], []
    for (x, y), target in itertools.product(signs, on_edge):
        origins.append((2 * x, 2 * y, target[2] + 0.5))
        targets.append(target)
    return HardCase(
        octants(),
        {
            "from one point": RaySet(towards((2, 2, 2), spread)),
            "from many": RaySet(towards(origins, targets)),
            "in the edge": RaySet(along([(0, 0, 5), (0, 5, 0), (0, 0, -5)], (0, 0, -1))),
        },
    )


@case(31)
def through_the_corner_of_eight_cells() -> HardCase:
    """All three planes are met at one parameter, and none of the eight cells may be taken
    for one that the ray passes by."""
    signs = rows(*itertools.product((-1.0, 1.0), repeat=3))
    uneven = signs * np.float32([3, 1.5, 0.75])
    outside = np.concatenate([2 * signs, uneven, uneven[:, [1, 2, 0]]])
    inside = outside / np.float32(8)
    return HardCase(
        octants(),
        {
            "from outside": RaySet(towards(outside, TOUCHED), every_ray_hits=True),
            "from inside": RaySet(towards(inside, TOUCHED), t=1),
            "from the corner": RaySet(along(TOUCHED, outside), every_ray_hits=True),
        },
    )
