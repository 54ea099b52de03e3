"""Rays at edges and vertices, and thin triangles."""

from __future__ import annotations

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

INSIDE = (0.0625, -0.15, 0.2)
"""A point in a sphere, off its planes of symmetry; two coordinates are rounded."""


@case(1)
def vertices_of_a_closed_mesh() -> HardCase:
    """Every edge function of the faces around a vertex is about zero there, so rounding
    can put the ray outside of all of them."""
    rng = generator()
    vertices, faces = workloads.sphere(3)
    origins = rng.uniform(-0.3, 0.3, (600, 3)).astype(np.float32)
    targets = rng.choice(vertices, 600)
    return HardCase(
        (vertices, faces),
        {
            "from one point": RaySet(towards(INSIDE, vertices), every_ray_hits=True),
            "from many": RaySet(towards(origins, targets), every_ray_hits=True),
        },
    )


@case(2)
def edges_of_a_closed_mesh() -> HardCase:
    """Points of edges are rounded to either side, and both faces must agree on which."""
    rng = generator()
    vertices, faces = workloads.sphere(3)
    corners = vertices[rng.choice(faces, 600)].astype(np.float64)
    share = np.where(np.arange(600)[:, None] % 2, 0.5, rng.uniform(size=(600, 1)))
    targets = corners[:, 0] + share * (corners[:, 1] - corners[:, 0])
    origins = rng.uniform(-0.3, 0.3, (600, 3)).astype(np.float32)
    return HardCase(
        (vertices, faces),
        {
            "from one point": RaySet(towards(INSIDE, targets), every_ray_hits=True),
            "from many": RaySet(towards(origins, targets), every_ray_hits=True),
        },
    )


@case(3)
def along_a_shared_edge_in_the_plane() -> HardCase:
    """All determinants vanish, for which 0 / 0 is the distance; nothing of the plane is
    hit, and what is behind it is."""
    floor = quad((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    wall = quad((3, -8, -8), (3, 8, -8), (3, 8, 8), (3, -8, 8))
    slopes = np.linspace(-1, 2, 97)
    fan = np.stack([np.ones(97), slopes, np.zeros(97)], axis=1)
    heights = np.arange(-32, 33) / 32
    parallel = np.stack([np.full(65, -1.0), heights, np.zeros(65)], axis=1)
    # Of the wall, face 2 has y >= z and face 3 has y <= z.
    return HardCase(
        joined(floor, wall),
        {
            # y = -1 + 4 slope at the wall.
            "from one point": RaySet(
                along((-1, -1, 0), fan), np.where(slopes >= 0.25, 2, 3), 4
            ),
            "along edges": RaySet(
                along(parallel, (1, 0, 0)), np.where(heights >= 0, 2, 3), 4
            ),
            "along the diagonal": RaySet(
                along([(-1 - i / 8, -1 - i / 8, 0) for i in range(9)], (1, 1, 0)),
                2,
                [4 + i / 8 for i in range(9)],
            ),
        },
    )


@case(14)
def needle_between_neighbours() -> HardCase:
    """The needle is 10^-7 wide, narrower than rays are apart from one another, and its two
    long edges must still be those of its neighbours."""
    scene = (
        rows((0, 0, 0), (1, 0, 0), (1, 1e-7, 0), (0.5, -1, 0), (0.5, 1, 0)),
        np.array([(0, 1, 2), (1, 0, 3), (0, 2, 4)], np.uint32),
    )
    rng = generator()
    x = rng.uniform(0.1, 0.9, 400)
    y = x * 1e-7 * rng.choice([0, 0.25, 0.5, 1, 3, -2], 400)
    targets = np.stack([x, y, np.zeros(400)], axis=1).astype(np.float32)
    origins = rng.uniform((-1, -1, 1), (2, 1, 2), (400, 3))
    upright = targets + np.float32([0, 0, 1])
    return HardCase(
        scene,
        {
            "from one point": RaySet(
                towards((0.3, 0.1, 1.5), targets), every_ray_hits=True
            ),
            "from many": RaySet(towards(origins, targets), every_ray_hits=True),
            "upright": RaySet(towards(upright, targets), every_ray_hits=True, t=1),
        },
    )


@case(15)
def cap_seen_edge_on() -> HardCase:
    """Three vertices nearly on one line: a determinant of rounding errors only gives hits
    far beyond all of them."""
    scene = triangles(
        ((600, 599, 0), (-600, -599, 0), (0, 1e-5, 0)),
        ((0.1, 0.2, 0.3), (200.1, 200.2, 200.3), (100.1, 100.20001, 100.3)),
    )
    rng = generator()
    targets = scene[0][rng.integers(0, 6, 300)] * rng.uniform(-1, 1, (300, 1))
    origins = rng.uniform(-300, 300, (300, 3))
    origins[::2, 2] = rng.choice([0, 1e-6, -1e-3], 150)
    steep = rng.uniform(-1, 1, (300, 3))
    return HardCase(
        scene,
        {
            "edge-on from one point": RaySet(towards((-700.1, -650.2, 1e-4), targets)),
            "edge-on from many": RaySet(towards(origins, targets)),
            "from above": RaySet(along((0, 0, 5), steep)),
        },
    )


@case(16)
def fan_of_ten_thousand_slivers() -> HardCase:
    """At the hub all slivers meet, and beside it a spoke is nearer than the roundings."""
    count = 10_000
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.25 * np.cos(angle)], axis=1)
    vertices = np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32)
    i = np.arange(count)
    faces = np.stack([np.zeros(count), 1 + i, 1 + (i + 1) % count], axis=1).astype(
        np.uint32
    )
    rng = generator()
    share = rng.uniform(0.001, 0.99, (120, 1))
    targets = (vertices[rng.integers(1, count + 1, 120)] * share).astype(np.float32)
    origins = rng.uniform((-1, -1, 3), (1, 1, 5), (120, 3))
    # One at the hub: exact arithmetic asks all slivers there.
    targets[:1] = 0
    return HardCase(
        (vertices, faces),
        {
            "from one point": RaySet(
                towards((0.1, 0.2, 3.3), targets), every_ray_hits=True
            ),
            "from many": RaySet(towards(origins, targets), every_ray_hits=True),
        },
    )


@case(24)
def vertex_on_an_edge() -> HardCase:
    """The vertex of a small face lies exactly on the edge of a large one: no crack is
    there, though no edge is shared."""
    scene = triangles(
        ((0, 0, 0), (2, 0, 0), (1, -2, 0)),
        ((0, 0, 0), (1, 0, 0), (0.5, 1, 0)),
        ((1, 0, 0), (2, 0, 0), (1.5, 1, 0)),
    )
    x = np.linspace(0.0625, 1.9375, 121)
    targets = np.stack([x, np.zeros(121), np.zeros(121)], axis=1)
    sideways = np.stack([x, 1 + x, 2 - x], axis=1)
    return HardCase(
        scene,
        {
            "from one point": RaySet(towards((1, 0.25, 2), targets), every_ray_hits=True),
            "from many": RaySet(towards(sideways, targets), every_ray_hits=True),
            # On the edge of the large face, which is the first of the list.
            "upright": RaySet(towards(np.add(targets, (0, 0, 1)), targets), 0, 1),
        },
    )


@case(28)
def grazing_a_tessellated_plane() -> HardCase:
    """At 10^-6 rad every edge of the plane is seen end-on, and one rounding of the
    direction moves the hit across many triangles."""
    scene = grid(16)
    rng = generator()
    steps = np.linspace(-0.9, 0.9, 19)
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    height = 2e-6
    # A ray falls by 10^-6 for each unit, so from `height` it meets the plane 2 further on.
    directions = np.stack([np.ones(361), np.zeros(361), np.full(361, -1e-6)], axis=1)
    origins = np.stack([x - 2, y, np.full(361, height)], axis=1)
    turned = directions.copy()
    turned[:, 1] = rng.uniform(-0.01, 0.01, 361)
    fan = np.stack([np.ones(361), np.linspace(-0.3, 0.3, 361), np.full(361, -1e-6)], axis=1)
    return HardCase(
        scene,
        {
            "parallel": RaySet(along(origins, directions), every_ray_hits=True),
            "in a row": RaySet(along(origins, turned), every_ray_hits=True),
            "from one point": RaySet(
                along((-2.5, 0.125, height), fan), every_ray_hits=True
            ),
        },
    )
