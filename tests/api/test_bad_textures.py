"""Textures that cannot be used: a sentence each, with file, element and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest
import texture_scenes
from plugin_scenes import bsdf, number, scene, text, texture
from texture_scenes import diffuse, image, mask, mesh, to_uv

from mlrt_plugin import SceneError, import_scene, prepare
from mlrt_plugin.scene_import import summarise
from mlrt_plugin.shading_choice import choice_for


def attribute(name: str) -> str:
    return texture("reflectance", "mesh_attribute", text("name", name))


SCENES = {
    "missing file": (
        mesh("quad.obj", diffuse(image("reflectance", "absent.png"))),
        r"bitmap.*absent\.png",
    ),
    "file of no bytes": (
        mesh("quad.obj", diffuse(image("reflectance", "empty.png"))),
        r"bitmap.*empty\.png",
    ),
    "not a number": (
        mesh("quad.obj", diffuse(image("reflectance", "nan.exr"))),
        r"'bitmap' at .*scene\.xml line .* 1 NaN or infinite pixel.*repair.*nan\.exr",
    ),
    "opacity is not a number": (
        mesh("quad.obj", mask(image("opacity", "nan.exr"), bsdf("diffuse"))),
        r"'bitmap' at .*NaN.*repair.*nan\.exr",
    ),
    "flat map": (
        mesh(
            "quad.obj",
            diffuse(image("reflectance", "image.png", to_uv('<scale x="0" y="2"/>'))),
        ),
        r"'bitmap' at .*to_uv.*no scale may be 0",
    ),
    "flat board": (
        mesh(
            "quad.obj",
            diffuse(texture("reflectance", "checkerboard", to_uv('<scale x="0"/>'))),
        ),
        r"'checkerboard' at .*to_uv.*no scale may be 0",
    ),
    "no such wrap mode": (
        mesh(
            "quad.obj",
            diffuse(image("reflectance", "image.png", text("wrap_mode", "tile"))),
        ),
        "bitmap.*tile",
    ),
    "no such attribute": (
        mesh("coloured.ply", diffuse(attribute("vertex_colour"))),
        r"'mesh_attribute' at .*'vertex_colour'.*'ply' at .*\(vertex_color\)",
    ),
    "no attributes": (
        mesh("plain.ply", diffuse(attribute("face_color"))),
        r"'face_color'.*'ply' at .*\(none\), or add it to the mesh",
    ),
    "attribute of no mesh": (
        mesh("plain.ply", diffuse(attribute("color"))),
        "mesh_attribute.*color",
    ),
    "colours as opacity": (
        mesh(
            "coloured.ply",
            mask(
                texture("opacity", "mesh_attribute", text("name", "vertex_color")),
                bsdf("diffuse"),
            ),
        ),
        "'mesh_attribute' at .*3 channels.*1 channel",
    ),
    "coordinates are not numbers": (
        mesh("lost.ply", diffuse(image("reflectance", "image.png"))),
        "'ply' at .* 1 vert.*NaN or infinite texture coordinates: repair the mesh",
    ),
}


@pytest.fixture
def assets(tmp_path: Path, scalar_variant: None) -> Path:
    texture_scenes.write_assets(tmp_path)
    return tmp_path


def scene_path(folder: Path, content: str) -> Path:
    path = folder / "scene.xml"
    path.write_text(content)
    return path


@pytest.mark.parametrize("name", SCENES)
def test_one_sentence_says_what_is_wrong(assets: Path, name: str) -> None:
    body, expected = SCENES[name]
    path = scene_path(assets, scene(body, texture_scenes.ONLY_LAMP))
    with pytest.raises(SceneError, match=expected) as error:
        prepare(path)
    assert "\n" not in str(error.value)


def test_mesh_without_coordinates_is_warned_of(assets: Path) -> None:
    body = mesh("plain.ply", diffuse(image("reflectance", "image.png")))
    path = scene_path(assets, scene(body, texture_scenes.ONLY_LAMP))
    (warning,) = import_scene(path).warnings
    assert "'ply' at" in warning and "no texture coordinates" in warning
    assert "give it some" in warning


def test_coordinates_matter_only_where_they_are_used(assets: Path) -> None:
    body = mesh("lost.ply", diffuse(number("reflectance", 0.5)))
    arrays = import_scene(scene_path(assets, scene(body, texture_scenes.ONLY_LAMP)))
    assert arrays.warnings == () and arrays.textures == ()
    assert arrays.uvs is not None and len(arrays.uvs) == 0


@pytest.mark.parametrize("name", ["eta", "k", "specular_reflectance"])
def test_lights_in_metals_of_which_the_index_varies_are_left_to_mitsuba(
    assets: Path, name: str
) -> None:
    body = mesh("quad.obj", bsdf("conductor", texture(name, "checkerboard", "")))
    direct = '<integrator type="direct">{}</integrator>'
    without = direct.format('<integer name="bsdf_samples" value="0"/>')
    paths = {}
    for lights in (texture_scenes.ONLY_LAMP, texture_scenes.PANEL):
        for integrator in (direct.format(""), without):
            path = scene_path(assets, scene(body, lights, integrator=integrator))
            summary = summarise(path)
            choice = choice_for(summary, None, summary.lighting)
            paths[lights, integrator] = choice.path
            assert choice.path == "native" or "'conductor'" in choice.reason
    hittable = {(texture_scenes.PANEL, direct.format(""))}
    by_mitsuba = {key for key, path in paths.items() if path == "mitsuba"}
    assert by_mitsuba == (set() if name == "specular_reflectance" else hittable)
