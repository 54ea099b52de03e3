"""Hit points and normals against Scene.ray_intersect."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import render_scenes
from core_scene import core_scene, scene_arguments

from mlrt_plugin._dispatch import core


@pytest.mark.parametrize("name", ["several", "mirrored", "mesh flat"])
def test_points_and_normals_equal_those_of_the_interaction(folder: Path, name: str) -> None:
    description = render_scenes.SCENES[name](folder)
    theirs = mi.load_dict(description, optimize=False)
    own = core_scene(description)
    shapes = scene_arguments(description)["shapes"]
    number = {shape.id(): i for i, shape in enumerate(theirs.shapes())}
    random = np.random.default_rng(29)
    seen = set()
    for _ in range(1500):
        origin = random.uniform([-2, 0.1, 1], [2, 2.5, 4]).astype(np.float32)
        target = random.uniform([-1.5, 0, -2], [1.5, 2, 1]).astype(np.float32)
        direction = target - origin
        hit = theirs.ray_intersect(mi.Ray3f(origin, direction))
        if not hit.is_valid():
            continue
        shape = number[hit.shape.id()]
        seen.add(hit.shape.id())
        primitive = shapes[shape]["first_face"] + hit.prim_index
        point = core.render_selftest.hit_surface(own, origin, direction, primitive)
        assert point["shape"] == shape
        np.testing.assert_allclose(point["p"], np.array(hit.p), atol=2e-5)
        np.testing.assert_allclose(point["face_normal"], np.array(hit.n), atol=2e-6)
        # Embree's barycentrics have single precision, and the ball's normals turn fast.
        np.testing.assert_allclose(
            point["shading_normal"], np.array(hit.sh_frame.n), atol=1e-4
        )
    assert len(seen) >= 5


def test_tiny_and_huge_triangles_have_normals() -> None:
    for size in (1e-18, 1e18):
        vertices = np.array([[0, 0, 0], [size, 0, 0], [0, size, 0]], np.float32)
        faces = np.array([[0, 1, 2]], np.uint32)
        scene = core.Scene(
            core.KdTree(vertices, faces),
            faces,
            np.zeros((0, 3), np.float32),
            [{"first_face": 0, "face_count": 1, "material": 0}],
            np.zeros((1, 2, 3), np.float32),
            [],
            {
                "origin": [0, 0, 1],
                "axes": np.eye(3),
                "tan_half_fov_x": 1,
                "near_clip": 0.1,
                "far_clip": 10,
            },
            {"width": 1, "height": 1, "filter": "box"},
        )
        point = core.render_selftest.hit_surface(
            scene, [0.25 * size, 0.5 * size, size], [0, 0, -1], 0
        )
        assert point["face_normal"] == [0, 0, 1]
        assert point["p"] == pytest.approx([0.25 * size, 0.5 * size, 0], rel=1e-6)
