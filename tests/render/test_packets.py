"""Sixteen surfaces or samples of lights at a time equal one at a time, bit for bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import pytest
import render_scenes
from core_scene import core_scene, scene_arguments

from mlrt_plugin._dispatch import core

LANES = 16


def bits(values: Any) -> npt.NDArray[np.uint32]:
    return np.asarray(values, np.float32).view(np.uint32)


@pytest.mark.parametrize("name", ["several", "mirrored", "mesh flat"])
def test_surfaces(folder: Path, name: str) -> None:
    description = render_scenes.SCENES[name](folder)
    own = core_scene(description)
    theirs = mi.load_dict(description, optimize=False)
    arguments = scene_arguments(description)
    number = {shape.id(): i for i, shape in enumerate(theirs.shapes())}
    random = np.random.default_rng(71)
    rays = []
    while len(rays) < 10 * LANES:
        origin = random.uniform([-2, 0.1, 1], [2, 2.5, 4]).astype(np.float32)
        target = random.uniform([-1.5, 0, -2], [1.5, 2, 1]).astype(np.float32)
        hit = theirs.ray_intersect(mi.Ray3f(origin, target - origin))
        if hit.is_valid():
            shape = arguments["shapes"][number[hit.shape.id()]]
            rays.append((origin, target - origin, shape["first_face"] + hit.prim_index))
    for first in range(0, len(rays), LANES):
        origins, directions, faces = zip(*rays[first : first + LANES], strict=True)
        packet = core.render_selftest.hit_packet(own, origins, directions, faces)
        for lane in range(LANES):
            single = core.render_selftest.hit_surface(
                own, origins[lane], directions[lane], faces[lane]
            )
            for key in ("p", "face_normal", "shading_normal"):
                np.testing.assert_array_equal(bits(packet[key][lane]), bits(single[key]))


def test_weights_equal_those_of_the_queries() -> None:
    random = np.random.default_rng(73)
    vertices = random.normal(size=(300, 3)).astype(np.float32)
    faces = np.arange(300, dtype=np.uint32).reshape(100, 3)
    tree = core.KdTree(vertices, faces)
    camera = {
        "origin": [0, 0, 5],
        "axes": np.eye(3),
        "tan_half_fov_x": 1,
        "near_clip": 0.1,
        "far_clip": 10,
    }
    film = {"width": 1, "height": 1, "filter": "box"}
    shapes = [{"first_face": 0, "face_count": 100, "material": 0}]
    scene = core.Scene(
        tree,
        faces[:0],
        np.zeros((0, 3), np.float32),
        shapes,
        np.zeros((1, 2, 3), np.float32),
        [],
        camera,
        film,
    )
    origins = (3 * random.normal(size=(2000, 3))).astype(np.float32)
    directions = (random.normal(size=(2000, 3)) - origins).astype(np.float32)
    _, primitive, u, v = tree.closest_hit(
        origins, directions, np.zeros(2000, np.float32), np.full(2000, np.inf, np.float32)
    )
    hits = np.flatnonzero(primitive >= 0)
    assert len(hits) > 500
    different = 0
    for first in range(0, len(hits) - LANES, LANES):
        some = hits[first : first + LANES]
        packet = core.render_selftest.hit_packet(
            scene,
            origins[some].tolist(),
            directions[some].tolist(),
            primitive[some].tolist(),
        )
        weights = bits(packet["weights"])
        np.testing.assert_array_equal(weights[:, 0], bits(u[some]))
        np.testing.assert_array_equal(weights[:, 1], bits(v[some]))
        corners = vertices.reshape(100, 3, 3)[primitive[some]]
        points = interpolated(corners, u[some], v[some])
        different += np.count_nonzero(bits(packet["p"]) != bits(points))
        np.testing.assert_allclose(packet["p"], points, rtol=1e-6, atol=1e-6)
    # Weights of single precision would make every second number another one.
    assert different < 0.001 * 3 * len(hits)


def interpolated(
    corners: npt.NDArray[np.float32], u: npt.NDArray[np.float32], v: npt.NDArray[np.float32]
) -> npt.NDArray[np.float32]:
    """Points of N triangles, corners (N, 3, 3), by the weights (N,) of the second and third
    corner: rounded as fused operations of single precision do it, but for double rounding.
    """
    a, b, c = (corners[:, k].astype(np.float64) for k in range(3))
    first = (np.float32(1) - u - v).astype(np.float64)[:, None]
    sum_of_two = b * u[:, None] + (c * v[:, None]).astype(np.float32)
    return np.asarray(a * first + sum_of_two.astype(np.float32), np.float32)


@pytest.mark.parametrize(
    "name", ["several", "spot", "mesh smooth", "mesh flat", "constant", "sky"]
)
def test_lights(folder: Path, name: str) -> None:
    own = core_scene(render_scenes.SCENES[name](folder))
    random = np.random.default_rng(79)
    lit = 0
    for _ in range(20):
        points = random.uniform([-1.5, 0, -1.5], [1.5, 1.5, 2], (LANES, 3))
        points = points.astype(np.float32)
        numbers = random.random((LANES, 3)).astype(np.float32)
        packet = core.render_selftest.emitter_packet(own, points.tolist(), numbers.tolist())
        for lane in range(LANES):
            x, y, _ = numbers[lane]
            single = core.render_selftest.sample_emitter(own, points[lane], x, y)
            assert packet["emitter"][lane] == single["emitter"]
            lit += any(single["weight"])
            for key in ("weight", "direction", "target"):
                np.testing.assert_array_equal(bits(packet[key][lane]), bits(single[key]))
    assert lit > 20
