"""Camera rays against the sensor's own."""

from __future__ import annotations

from typing import Any

import core_scene
import mitsuba as mi
import numpy as np
import pytest
import render_scenes

from mlrt_plugin._dispatch import core

FILMS: dict[str, dict[str, Any]] = {
    "whole": {},
    "tall": {"width": 50, "height": 91},
    "crop": {
        "width": 128,
        "height": 96,
        "crop_offset_x": 31,
        "crop_offset_y": 9,
        "crop_width": 40,
        "crop_height": 60,
    },
}
SENSORS: dict[str, dict[str, Any]] = {
    "plain": {},
    "wide": {"fov": 110, "fov_axis": "smaller"},
    "offset": {"principal_point_offset_x": 0.2, "principal_point_offset_y": -0.1},
    "far": {"near_clip": 2.5, "far_clip": 7.0, "fov_axis": "diagonal"},
}


@pytest.mark.parametrize("film", FILMS)
@pytest.mark.parametrize("sensor", SENSORS)
def test_rays_equal_those_of_the_sensor(film: str, sensor: str) -> None:
    film_dict = render_scenes.film(**FILMS[film])
    camera = mi.load_dict(render_scenes.sensor(film_dict, **SENSORS[sensor]))
    camera_dict = core_scene.camera_of(camera)
    core_film = core_scene.film_of(camera.film(), film_dict)
    plane = core.image_plane(camera_dict, core_film)
    random = np.random.default_rng(5)
    for _ in range(200):
        sample = random.random(2)
        x = core_film["crop_x"] + sample[0] * core_film["crop_width"]
        y = core_film["crop_y"] + sample[1] * core_film["crop_height"]
        ray, _weight = camera.sample_ray(0.0, 0.0, sample, [0.5, 0.5])
        d = np.array(core.render_selftest.camera_direction(camera_dict, core_film, x, y))
        np.testing.assert_allclose(d / np.linalg.norm(d), np.array(ray.d), atol=2e-6)
        # The first point of Mitsuba's ray is ours at t = near, its last at t = far; both to
        # a few roundings of its single precision.
        origin = np.array(camera_dict["origin"])
        for t_own, t_theirs in [
            (camera_dict["near_clip"], 0.0),
            (camera_dict["far_clip"], ray.maxt),
        ]:
            scale = np.abs(origin).max() + t_own * np.linalg.norm(d)
            np.testing.assert_allclose(
                origin + t_own * d,
                np.array(ray.o) + t_theirs * np.array(ray.d),
                atol=4e-6 * scale,
            )
        exact = (
            np.array(plane["base"]) + x * np.array(plane["dx"]) + y * np.array(plane["dy"])
        )
        np.testing.assert_allclose(d, exact, atol=1e-6 * np.abs(exact).max())
        # t is the depth along the camera's axis.
        assert exact @ np.array(camera_dict["axes"][2]) == pytest.approx(1, abs=1e-6)
