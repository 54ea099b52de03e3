"""Bitmaps of loaded scenes: how they are looked up is found by asking them."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import pytest
import texture_scenes

from mlrt_plugin import import_scene
from mlrt_plugin.elements import Element
from mlrt_plugin.texture_arrays import BitmapTexture
from mlrt_plugin.textures import read_bitmap

SEED = 31


@pytest.fixture(autouse=True)
def variant(scalar_variant: None) -> None:
    """All of these run in scalar_rgb."""


def pictures() -> dict[str, npt.NDArray[Any]]:
    random = np.random.default_rng(SEED)
    noise = (random.random((9, 13, 3)) * 255).astype(np.uint8)
    one_pixel = np.zeros((30, 40, 3), np.uint8)
    one_pixel[4, 33] = 255, 128, 0
    across, down = (np.tile(a, b).astype(np.float32) for a, b in ramps())
    symmetric = noise.astype(np.float32) / 255
    symmetric[:, 7:] = symmetric[:, 5::-1]
    return {
        "noise": noise,
        "one pixel": one_pixel,
        "ramp across": across,
        "ramp down": down,
        "symmetric": symmetric,
        "grey": noise[..., :1],
    }


def ramps() -> list[tuple[npt.NDArray[Any], tuple[int, int, int]]]:
    ramp = np.linspace(0, 1, 8)
    return [(ramp[None, :, None], (5, 1, 3)), (ramp[:, None, None], (1, 6, 3))]


MODES = list(
    itertools.product(
        ("nearest", "bilinear"), ("repeat", "mirror", "clamp"), (False, True), (1.0, -2.5)
    )
)


@pytest.mark.parametrize("name", pictures())
def test_answers_are_those_of_the_properties(name: str) -> None:
    for filter_type, wrap, raw, scale in MODES:
        texture = mi.load_dict(
            {
                "type": "bitmap",
                "bitmap": mi.Bitmap(pictures()[name]),
                "filter_type": filter_type,
                "wrap_mode": wrap,
                "raw": raw,
                "to_uv": mi.ScalarTransform4f().scale([scale, 3, 1]),
            }
        )
        own = read_bitmap(texture, Element("texture", "bitmap", loaded=True), False)
        found = "nearest" if own.nearest else "bilinear"
        assert (found, own.wrap) == (filter_type, wrap)
        is_srgb = pictures()[name].dtype == np.uint8 and not raw
        if own.decoded is not None:
            assert (own.decoded[128] < 0.3) == is_srgb


def test_a_picture_of_one_colour_may_be_anything() -> None:
    flat = mi.load_dict({"type": "bitmap", "bitmap": mi.Bitmap(np.ones((4, 4, 3)))})
    own = read_bitmap(flat, Element("texture", "bitmap", loaded=True), False)
    assert own.texels.shape == (4, 4, 3)


@pytest.mark.parametrize("name", ["nearest mirror", "bilinear clamp", "images"])
def test_loaded_scene_has_the_textures_of_its_file(tmp_path: Path, name: str) -> None:
    texture_scenes.write_assets(tmp_path)
    path = tmp_path / "scene.xml"
    path.write_text(texture_scenes.SCENES[name])
    of_file = import_scene(path).textures
    of_scene = import_scene(mi.load_file(str(path), optimize=False)).textures
    assert len(of_file) == len(of_scene) > 0
    for one, other in zip(of_file, of_scene, strict=True):
        assert isinstance(one, BitmapTexture) and isinstance(other, BitmapTexture)
        np.testing.assert_array_equal(one.texels, other.texels)
        np.testing.assert_array_equal(one.decoded, other.decoded)
        assert one.nearest == other.nearest
        assert one.wrap == other.wrap or name == "images"
        assert (one.to_u, one.to_v) == (other.to_u, other.to_v)
