"""Pictures of few samples for their triangles, which are traced by packets."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scene_files
import workloads

from mlrt_plugin.render import PreparedScene, prepare

SceneFile = Callable[..., Path]


@pytest.fixture
def ball(scene_file: SceneFile, tmp_path: Path) -> PreparedScene:
    """A ball of 8,192 triangles by a lamp, of 16 x 12 pixels."""
    vertices, faces = workloads.sphere(5)
    (tmp_path / "ball.ply").write_bytes(scene_files.ply_bytes(vertices, faces))
    prepared = prepare(scene_file(shapes=scene_files.mesh_shape("ball.ply")))
    assert isinstance(prepared, PreparedScene)
    assert prepared.report["references"] >= 8192
    return prepared


def test_few_samples_take_packets_and_many_beams(ball: PreparedScene) -> None:
    few = ball.render(spp=1)
    assert few.image.max() > 0
    assert few.counters["primary_beams"] == few.counters["shadow_beams"] == 0
    assert few.counters["primary_traversal_steps"] > 0
    many = ball.render(spp=64)
    assert many.counters["primary_beams"] > 0
    assert many.counters["shadow_beams"] > 0


@pytest.mark.parametrize("traversal", ["brute_force", "beam_leaf"])
def test_they_give_the_picture_of_other_ways(ball: PreparedScene, traversal: str) -> None:
    asked = ball.render(spp=1, traversal=traversal)
    np.testing.assert_array_equal(ball.render(spp=1).image, asked.image)


def test_what_is_asked_for_is_kept(ball: PreparedScene) -> None:
    assert ball.render(spp=1, traversal="beam_leaf").counters["primary_beams"] > 0


def test_many_such_pictures_get_the_wide_tree(ball: PreparedScene) -> None:
    first = ball.render(spp=1).image
    # It is made for two rays a reference: those of the camera, and shadow rays for each.
    frames = 2 * ball.report["references"] // (2 * 16 * 12)
    for _ in range(frames // 2):
        ball.render(spp=1)
    assert ball.report["wide_bytes"] == 0
    for _ in range(frames):
        ball.render(spp=1)
    assert ball.report["wide_bytes"] > 0
    np.testing.assert_array_equal(ball.render(spp=1).image, first)
