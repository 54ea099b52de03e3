"""Sensors other than `perspective`: how they are read, and what is wrong with them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files

from mlrt_plugin import MlrtError, import_scene, prepare, render
from mlrt_plugin.image_plane import image_plane

SceneFile = Callable[..., Path]


def number(name: str, value: object) -> str:
    return f'<float name="{name}" value="{value}"/>'


def sensor(plugin: str, parameters: str = "", moved: str = "") -> str:
    return (
        scene_files.SENSOR.replace("perspective", plugin)
        .replace("<sampler", f"{parameters}<sampler")
        .replace("</transform>", f"{moved}</transform>")
    )


def lens(radius: object, focus: object = 3, moved: str = "") -> str:
    parameters = number("aperture_radius", radius) + number("focus_distance", focus)
    return sensor("thinlens", parameters, moved)


PLACE = r"with id 'eye' at .*scene\.xml line \d+:\d+"
BAD = {
    "negative aperture": (lens(-0.1), f"{PLACE} has aperture_radius = -0.1.*positive"),
    "NaN aperture": (lens("nan"), f"{PLACE} has aperture_radius = nan"),
    "no aperture": (sensor("thinlens"), "aperture_radius"),
    "no focus": (lens(0.1, 0), f"{PLACE} has focus_distance = 0: it must be positive"),
    "negative focus": (lens(0.1, -2), "focus_distance = -2"),
    "scaled lens": (lens(0.1, moved='<scale value="2"/>'), "[Ss]cale"),
    "flat parallel": (sensor("orthographic", moved='<scale y="0"/>'), f"{PLACE}.*singular"),
    "parallel nowhere": (sensor("orthographic", moved='<translate x="nan"/>'), "to_world"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_sensors(scene_file: SceneFile, name: str) -> None:
    eye, expected = BAD[name]
    with pytest.raises(MlrtError, match=expected) as caught:
        render(scene_file(sensor=eye), shading="native")
    assert "\n" not in str(caught.value)


def test_an_aperture_of_zero_is_a_pinhole_and_said_so(scene_file: SceneFile) -> None:
    path = scene_file(sensor=lens(0))
    arrays = import_scene(path)
    (warning,) = arrays.warnings
    assert re.search(f"{PLACE} has aperture_radius = 0.*'perspective'", warning)
    # The lens takes random numbers, so the pictures have other noise.
    image = prepare(arrays).render(spp=64).image
    pinhole = prepare(scene_file("pinhole.xml", sensor=sensor("perspective")))
    np.testing.assert_allclose(image.mean(), pinhole.render(spp=64).image.mean(), rtol=0.02)


def test_scaled_parallel_rays_begin_where_mitsubas_do(scene_file: SceneFile) -> None:
    path = scene_file(
        sensor=sensor(
            "orthographic",
            number("near_clip", 0.5) + number("far_clip", 7),
            '<scale x="3" y="2" z="4"/>',
        )
        .replace("<lookat", '<scale x="3" y="2" z="4"/><lookat')
        .replace('<scale x="3" y="2" z="4"/></transform>', "</transform>")
    )
    camera = import_scene(path).camera
    mi.set_variant("scalar_rgb")
    theirs = mi.load_file(str(path)).sensors()[0]
    width, height = theirs.film().size()
    random = np.random.default_rng(29)
    for u, v in random.random((20, 2)):
        ray, _ = theirs.sample_ray(0, 0, [u, v], [0.5, 0.5])
        x_axis, y_axis, z_axis = np.array(camera.axes)
        along_x = (1 - 2 * u) * camera.half_extent[0]
        along_y = (1 - 2 * v) * camera.half_extent[1] * height / width
        start = camera.origin + along_x * x_axis + along_y * y_axis
        start += camera.near_clip * z_axis
        np.testing.assert_allclose(np.array(ray.o), start, atol=1e-5)
        np.testing.assert_allclose(np.array(ray.d), z_axis, atol=1e-6)
        assert ray.maxt == pytest.approx(camera.far_clip - camera.near_clip)


def test_tiles_need_a_common_origin(scene_file: SceneFile) -> None:
    arrays = import_scene(scene_file(sensor=lens(0.1)))
    with pytest.raises(MlrtError, match="'thinlens' have no common origin"):
        image_plane(arrays.camera, arrays.film)
