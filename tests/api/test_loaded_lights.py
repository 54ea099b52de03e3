"""Lights of loaded scenes: what Mitsuba keeps to itself is found by asking them."""

from __future__ import annotations

import math
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import pytest

from mlrt_plugin import import_scene
from mlrt_plugin.scene_arrays import Emitter, Lighting, SceneArrays
from mlrt_plugin.shading_choice import choose_shading

SEED = 17
BOARD = {"type": "checkerboard"}


@pytest.fixture(autouse=True)
def variant(scalar_variant: None) -> None:
    """All of these run in scalar_rgb."""


def loaded(**light: Any) -> Any:
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "perspective"},
            "floor": {"type": "rectangle"},
            "light": light,
        }
    )


def arrays_of(**light: Any) -> SceneArrays:
    lighting = Lighting(emitter_samples=1, bsdf_samples=0)
    return import_scene(loaded(**light), lighting=lighting)


def light_of(**light: Any) -> Emitter:
    (emitter,) = arrays_of(**light).emitters
    return emitter


def skies() -> dict[str, npt.NDArray[np.float32]]:
    random = np.random.default_rng(SEED)
    noise = random.random((9, 14, 3)).astype(np.float32)
    sun = np.full((12, 20, 3), 0.2, np.float32)
    sun[3, 7] = 50, 40, 30
    night = np.zeros((6, 8, 3), np.float32)
    night[2, 2], night[3, 6] = 0.3, 5
    return {"noise": noise, "sun": sun, "night": night, "slope": np.sort(noise, axis=0)}


@pytest.mark.parametrize("name", skies())
@pytest.mark.parametrize("compensated", [False, True])
def test_compensation_is_found(name: str, compensated: bool) -> None:
    print(f"seed {SEED}")
    to_world = mi.ScalarTransform4f().rotate([0.6, 0.8, 0], 50)
    light = light_of(
        type="envmap",
        bitmap=mi.Bitmap(skies()[name]),
        mis_compensation=compensated,
        to_world=to_world,
    )
    assert light.mis_compensation == compensated


def test_light_that_is_left_out_is_warned_of() -> None:
    sky = {"type": "envmap", "bitmap": mi.Bitmap(skies()["noise"])}
    assert arrays_of(**sky).warnings == ()
    (warning,) = arrays_of(**sky, mis_compensation=True).warnings
    assert "mis_compensation" in warning and "missing" in warning
    both = Lighting(emitter_samples=1, bsdf_samples=1)
    scene = loaded(**sky, mis_compensation=True)
    assert import_scene(scene, lighting=both).warnings == ()


@pytest.mark.parametrize("to_world", [None, "moved"])
def test_field_of_view_of_a_projector_is_found(to_world: str | None) -> None:
    place = mi.ScalarTransform4f()
    if to_world:
        place = place.translate([3, 40, -2]).rotate([0.6, 0, 0.8], 100).scale([2, 0.5, 3])
    picture = mi.Bitmap(np.ones((10, 40, 3), np.float32))
    light = light_of(
        type="projector",
        irradiance={"type": "bitmap", "bitmap": picture, "raw": True},
        fov=50,
        to_world=place,
    )
    expected = math.tan(math.radians(25))
    assert light.half_size == pytest.approx((expected, expected / 4), rel=1e-5)


@pytest.mark.parametrize("plugin", ["sphere", "cylinder"])
def test_turned_shapes_with_textured_lights_are_mitsubas(plugin: str) -> None:
    light = {"type": "area", "radiance": BOARD}
    straight = mi.ScalarTransform4f().translate([1, 2, 3]).scale(0.5)
    turned = straight.rotate([0, 0, 1], 30)
    paths = [
        choose_shading(loaded(type=plugin, to_world=place, emitter=light)).path
        for place in (straight, turned)
    ]
    assert paths == ["native", "mitsuba"]
