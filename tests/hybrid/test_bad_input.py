"""What Mitsuba's plugins cannot shade is told in one sentence, and how to mend it."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import mitsuba as mi
import numpy as np
import plugin_scenes as parts
import pytest

from mlrt_plugin import MlrtError, SceneError, UnsupportedFeature, prepare, render

SHINY = parts.bsdf("roughplastic")
SCALED = '<scale value="0.4"/>'


def textured(file: str) -> str:
    image = parts.texture("reflectance", "bitmap", parts.text("filename", file))
    return parts.scene(parts.block(parts.bsdf("diffuse", image)))


def png_without_pixels() -> bytes:
    header = b"IHDR" + struct.pack(">IIBBBBB", 0, 0, 8, 2, 0, 0, 0)
    checksum = struct.pack(">I", zlib.crc32(header))
    return b"\x89PNG\r\n\x1a\n" + struct.pack(">I", 13) + header + checksum


def moved(transform: str, plugin: str = "cube") -> str:
    return parts.scene(parts.block(SHINY, plugin=plugin).replace(SCALED, transform))


def seen_by(eye: str) -> str:
    return parts.scene(parts.block(SHINY), eye=eye)


def lit_by(lights: str) -> str:
    return parts.scene(parts.block(SHINY), lights=lights)


def film(more: str) -> str:
    return seen_by(
        parts.sensor().replace('<film type="hdrfilm">', f'<film type="hdrfilm">{more}')
    )


NAN_PANEL = parts.PANEL.replace("2, 2.5, 3", "2, nan, 3")
SKY = '<emitter type="envmap"><string name="filename" value="{}"/></emitter>'
CROP = '<integer name="crop_width" value="99"/><integer name="crop_height" value="9"/>'
CASES = {
    "unknown material": (
        parts.scene(parts.block(parts.bsdf("toon"))),
        r"bsdf 'toon'.*not found; check the spelling",
    ),
    "unknown shape": (parts.scene('<shape type="teapot"/>'), "shape 'teapot'.*spelling"),
    "unknown sampler": (seen_by(parts.sensor(sampler="sobol")), "'sobol'.*spelling"),
    "unknown integrator": (
        parts.scene(parts.block(SHINY), integrator='<integrator type="magic"/>'),
        "'magic'.*none of Mitsuba's.*--force-direct",
    ),
    "unknown parameter": (
        parts.scene(parts.block(parts.bsdf("plastic", parts.number("shine", 3)))),
        "shine.*remove the property",
    ),
    "missing texture": (textured("absent.png"), "absent.png.*check the path"),
    "empty texture": (textured("empty.png"), "empty.png.*truncated"),
    "texture without pixels": (textured("no-pixels.png"), "no-pixels.png'; the image is"),
    "NaN in a material": (
        parts.scene(parts.block(parts.bsdf("plastic", parts.number("int_ior", np.nan)))),
        "'plastic'.*int_ior = nan",
    ),
    "NaN radiance": (lit_by(NAN_PANEL), r"emitter 'area'.*radiance = \(2, nan, 3\)"),
    "infinite radiance": (
        lit_by('<emitter type="constant"><float name="radiance" value="inf"/></emitter>'),
        "'constant'.*radiance = inf",
    ),
    "NaN envmap": (lit_by(SKY.format("nan.exr")), "'envmap'.*NaN or infinite values"),
    "missing envmap": (lit_by(SKY.format("absent.exr")), "'envmap'.*check the path"),
    "flattened": (moved('<scale x="0"/>'), "'cube'.*singular to_world"),
    "flattened sphere": (moved('<scale y="0"/>', "sphere"), "'sphere'.*singular"),
    "no radius": (
        parts.scene(f'<shape type="sphere">{parts.number("radius", 0)}</shape>'),
        "radius = 0",
    ),
    "nowhere": (moved('<translate x="nan"/>'), "'cube'.*NaN"),
    "flattened camera": (
        seen_by(parts.sensor(view='<transform name="to_world"><scale x="0"/></transform>')),
        "'perspective'.*singular to_world",
    ),
    "crop outside of the film": (film(CROP), "make the crop window lie within the film"),
    "no film": (seen_by(parts.sensor(size=(0, 9))), "width = 0"),
    "too large a film": (seen_by(parts.sensor(size=(10**6, 10**6))), "1000000x1000000"),
    "no samples": (seen_by(parts.sensor(spp=0)), "'independent'.*sample_count = 0"),
    "no light": (lit_by(""), "no emitter"),
    "no group": (parts.scene('<shape type="instance"/>'), "shapegroup"),
}


@pytest.fixture(scope="module")
def broken_assets(assets: Path) -> Path:
    (assets / "empty.png").write_bytes(b"")
    (assets / "no-pixels.png").write_bytes(png_without_pixels())
    mi.Bitmap(np.full((4, 8, 3), np.nan, np.float32)).write(str(assets / "nan.exr"))
    return assets


@pytest.mark.parametrize("name", CASES)
def test_bad_scenes(broken_assets: Path, name: str) -> None:
    xml, expected = CASES[name]
    path = broken_assets / "bad.xml"
    path.write_text(xml)
    with pytest.raises(MlrtError, match=expected) as caught:
        render(path, shading="mitsuba")
    assert "\n" not in str(caught.value)


REFUSED = {
    "batch": seen_by(f'<sensor type="batch">{parts.sensor()}{parts.sensor()}</sensor>'),
    "specfilm": seen_by(parts.sensor().replace("hdrfilm", "specfilm")),
    "timed_sunsky": lit_by('<emitter type="timed_sunsky"/>'),
    "blackbody": parts.scene(
        parts.block(parts.bsdf("diffuse", parts.texture("reflectance", "blackbody")))
    ),
}


@pytest.mark.parametrize("plugin", REFUSED)
def test_what_nobody_renders_is_refused_by_name(assets: Path, plugin: str) -> None:
    path = assets / "refused.xml"
    path.write_text(REFUSED[plugin])
    with pytest.raises(UnsupportedFeature, match=f"'{plugin}' at .* is not supported: "):
        render(path)


def test_instances_beyond_measure_are_refused(assets: Path) -> None:
    """Mitsuba would compile for hours; and the places of so many elements are told in
    seconds."""
    one = '<shape type="instance"><ref id="group"/></shape>'
    path = assets / "many.xml"
    path.write_text(
        parts.scene(
            '<shape type="shapegroup" id="group"><shape type="sphere"/></shape>'
            + one * 10_000
        )
    )
    with pytest.raises(UnsupportedFeature, match="10000 instances that cannot be written"):
        render(path, shading="mitsuba")


def test_variants_that_cannot_shade_are_named(assets: Path) -> None:
    path = assets / "shiny.xml"
    path.write_text(parts.scene(parts.block(SHINY)))
    mi.set_variant("scalar_rgb")
    scene = mi.load_file(str(path))
    with pytest.raises(
        UnsupportedFeature, match=r"scalar_rgb.*'RoughPlastic'.*llvm_ad_rgb"
    ):
        render(scene)
    with pytest.raises(SceneError, match="cannot be defined"):
        mi.set_variant("llvm_ad_rgb")
        render(mi.load_file(str(path)), defines={"a": 1})


def test_what_mitsuba_warns_of_is_told(assets: Path) -> None:
    path = assets / "stretched.xml"
    path.write_text(moved('<scale x="2" y="1" z="1"/>', "sphere"))
    assert any("non-uniform scaling" in text for text in prepare(path).warnings)


@pytest.mark.parametrize("plugin", ["cube", "sphere"])
def test_mirrored_shapes_are_those_of_mitsuba(assets: Path, plugin: str) -> None:
    path = assets / "mirrored.xml"
    path.write_text(moved('<scale x="-0.4" y="0.4" z="0.4"/>', plugin))
    scene = mi.load_file(str(path), optimize=False)
    expected = np.array(mi.render(scene, seed=3))
    image = render(path, seed=3).image
    np.testing.assert_allclose(image, expected, rtol=1e-4, atol=1e-6)
