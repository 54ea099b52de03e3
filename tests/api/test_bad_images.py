"""Images without pixels, in files and in memory, and images in memory that are fine."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files
from plugin_scenes import block, bsdf, scene
from texture_scenes import DIRECT_WITHOUT, image

import mlrt_plugin
from mlrt_plugin import SceneError

FILES = {
    "zero.ppm": b"P6\n0 0\n255\n",
    "column.ppm": b"P6 # made by hand\n4\n# none\n0\n255\n",
    "grey.pgm": b"P5\n0 3\n255\n",
    "zero.pfm": b"PF\n0 0\n-1.0\n",
    "grey.pfm": b"Pf\n5 0\n-1.0\n",
    "zero.hdr": b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n",
}
"""Mitsuba crashes on most of these."""


@pytest.fixture(autouse=True)
def variant(scalar_variant: None) -> None:
    """All of these run in scalar_rgb."""


@pytest.mark.parametrize("shading", ["native", "mitsuba"])
@pytest.mark.parametrize("name", FILES)
def test_file_without_pixels_is_named(tmp_path: Path, name: str, shading: str) -> None:
    (tmp_path / name).write_bytes(FILES[name])
    screen = f'<emitter type="area">{image("radiance", name)}</emitter>'
    sky = f'<emitter type="envmap"><string name="filename" value="{name}"/></emitter>'
    for body in (
        block(bsdf("diffuse", image("reflectance", name))),
        block(screen, 0, "rectangle"),
        sky,
    ):
        path = tmp_path / "scene.xml"
        path.write_text(scene(body, integrator=DIRECT_WITHOUT))
        with pytest.raises(SceneError, match=rf"{name}' has \dx\d pixels: export it anew"):
            mlrt_plugin.prepare(path, shading=shading)


def textured(texture: dict[str, object]) -> dict[str, object]:
    material = {"type": "diffuse", "reflectance": {"type": "bitmap", **texture}}
    floor = {"type": "rectangle", "material": material}
    lamp = {"type": "point", "position": [0, 0, 3]}
    eye = {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}}
    eye["to_world"] = mi.ScalarTransform4f().look_at([0, 0, 3], [0, 0, 0], [0, 1, 0])
    return scene_files.scene_dict(floor=floor, lamp=lamp, eye=eye)


@pytest.mark.parametrize("shape", [(0, 0, 3), (4, 0, 3), (0, 4, 1)])
@pytest.mark.parametrize("shading", ["native", "mitsuba"])
def test_image_in_memory_without_pixels_is_named(
    shape: tuple[int, int, int], shading: str
) -> None:
    nothing = np.zeros(shape, np.float32)
    for texture in (
        {"bitmap": mi.Bitmap(nothing)},
        {"data": mi.TensorXf(nothing), "raw": True},
    ):
        with pytest.raises(SceneError, match=r"'bitmap' .* of no pixels: give it some"):
            mlrt_plugin.prepare(textured(texture), shading=shading)


@pytest.mark.parametrize("shading", ["native", "mitsuba"])
def test_image_in_memory_is_seen(shading: str) -> None:
    """As a colour in its place is."""
    colour = np.tile(np.array([0.2, 0.5, 0.8], np.float32), (4, 6, 1))
    result = mlrt_plugin.render(textured({"bitmap": mi.Bitmap(colour)}), shading=shading)
    plain = textured({})
    plain["floor"]["material"]["reflectance"] = {  # type: ignore[index]
        "type": "rgb",
        "value": [0.2, 0.5, 0.8],
    }
    expected = mlrt_plugin.render(plain, shading=shading).image
    assert expected.max() > 0.01
    np.testing.assert_allclose(result.image, expected, rtol=1e-5, atol=1e-7)
