"""Who shades a scene, and that the reason is told."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import plugin_scenes
import pytest
import scene_files

from mlrt_plugin import MlrtError, SceneError, UnsupportedFeature, import_scene, prepare
from mlrt_plugin.info import scene_report
from mlrt_plugin.shading_choice import choose_shading

SceneFile = Callable[..., Path]

SHINY = '<shape type="cube"><bsdf type="plastic" id="shiny"/></shape>'
METAL = (
    '<shape type="cube"><bsdf type="conductor" id="metal">'
    '<texture type="checkerboard" name="eta"/></bsdf></shape>'
)
GLOWING = '<shape type="rectangle"><emitter type="area"/></shape>'


def integrator(plugin: str, tag: str, name: str, value: object) -> str:
    return (
        f'<integrator type="{plugin}"><{tag} name="{name}" value="{value}"/></integrator>'
    )


def test_native_scenes_stay_native(scene_file: SceneFile) -> None:
    path = scene_file()
    assert str(choose_shading(path)) == (
        "native, because all plugins of the scene are native"
    )
    assert choose_shading(path, "mitsuba").path == "mitsuba"
    prepared = prepare(path)
    assert prepared.shading.path == "native" and prepared.spp == 2


@pytest.mark.parametrize(
    ("parts", "reason"),
    [
        ({"shapes": SHINY}, r"bsdf 'plastic' with id 'shiny' at .*:21 is not native"),
        ({"shapes": '<shape type="sdfgrid" id="ball"/>'}, "shape 'sdfgrid' with id 'ball'"),
        (
            {
                "integrator": integrator("direct", "integer", "emitter_samples", 0),
                "shapes": METAL,
                "emitters": GLOWING,
            },
            "lights in bsdf 'conductor' with id 'metal'.*BSDF.*'direct'.*index .* varies",
        ),
        (
            {"integrator": integrator("mlrt", "integer", "bsdf_samples", 300)},
            "integrator 'mlrt'.*bsdf_samples = 300, and at most 256 are taken natively",
        ),
        (
            {"integrator": integrator("direct", "integer", "emitter_samples", 257)},
            "emitter_samples = 257, and at most 256 are taken natively",
        ),
        ({"shapes": SHINY + '<shape type="sdfgrid"/>'}, "'plastic'.*, and 1 more$"),
    ],
)
def test_reasons_for_mitsuba_are_named(
    scene_file: SceneFile, parts: dict[str, str], reason: str
) -> None:
    path = scene_file(**parts)
    choice = choose_shading(path)
    assert choice.path == "mitsuba"
    assert re.search(reason, choice.reason), choice.reason
    assert f"shading: {choice}" in scene_report(path)
    with pytest.raises(UnsupportedFeature):
        prepare(path, shading="native")


def test_scene_may_choose(scene_file: SceneFile) -> None:
    path = scene_file(integrator=integrator("mlrt", "string", "shading", "mitsuba"))
    assert choose_shading(path).path == "mitsuba"
    assert choose_shading(path, "native").path == "native"
    path = scene_file(integrator=integrator("mlrt", "string", "shading", "toon"))
    with pytest.raises(MlrtError, match="shading = 'toon' does not exist"):
        choose_shading(path)


AOV = (
    '<integrator type="aov"><string name="aovs" value="{}"/>'
    '<integrator type="{}"/></integrator>'
)


@pytest.mark.parametrize(
    ("xml", "missing"),
    [
        (integrator("path", "integer", "max_depth", 3), "further bounces"),
        ('<integrator type="volpath"/>', "participating media"),
        ('<integrator type="moment"/>', "second moments"),
        ('<integrator type="nothing"/>', "none of Mitsuba's own"),
        (AOV.format("a:albedo", "direct"), "the AOV 'albedo'"),
        (AOV.format("d:depth", "path"), "further bounces"),
        (AOV.format("d:depth", "moment"), "'moment' in it"),
        (
            '<integrator type="moment"><integrator type="path"/></integrator>',
            "further bounces",
        ),
    ],
)
def test_what_would_be_missing_must_be_allowed(
    scene_file: SceneFile, xml: str, missing: str
) -> None:
    path = scene_file(integrator=xml)
    with pytest.raises(UnsupportedFeature, match=f"{missing}.*--force-direct"):
        import_scene(path)
    assert any(text.startswith("needs --force-direct") for text in scene_report(path))
    (warning,) = import_scene(path, force_direct=True).warnings
    assert "is missing" in warning


def test_paths_of_two_segments_are_direct_light(scene_file: SceneFile) -> None:
    path = scene_file(integrator=integrator("path", "integer", "max_depth", 2))
    assert import_scene(path).warnings == ()
    path = scene_file(integrator=integrator("path", "integer", "max_depth", 0))
    with pytest.raises(SceneError, match="black"):
        import_scene(path)


def test_paths_of_one_segment_end_at_lights(scene_file: SceneFile) -> None:
    one = integrator("path", "integer", "max_depth", 1)
    image = prepare(scene_file(integrator=one, emitters=GLOWING)).render().image
    assert set(np.unique(image)) == {0.0, 0.5, 1.0}  # of two samples a pixel


@pytest.mark.parametrize("counts", [(0, 1), (2, 3), (1, 0)])
def test_samples_are_told(scene_file: SceneFile, counts: tuple[int, int]) -> None:
    xml = "".join(
        f'<integer name="{name}" value="{count}"/>'
        for name, count in zip(("emitter_samples", "bsdf_samples"), counts, strict=True)
    )
    path = scene_file(
        integrator=f'<integrator type="direct">{xml}</integrator>', emitters=GLOWING
    )
    assert choose_shading(path).path == "native"
    line = f"light samples: {counts[0]} of emitters, {counts[1]} of BSDFs"
    assert line in scene_report(path)
    # A lamp is met by no ray.
    lit = scene_file(integrator=f'<integrator type="direct">{xml}</integrator>')
    assert f"light samples: {counts[0]} of emitters, 0 of BSDFs" in scene_report(lit)


def test_aovs_of_the_scene_are_rendered(scene_file: SceneFile) -> None:
    path = scene_file(integrator=AOV.format("z:depth, n:sh_normal", "direct"))
    result = prepare(path).render()
    plain = prepare(scene_file("plain.xml")).render(aovs=("depth", "normal"))
    assert list(result.aovs) == ["depth", "normal"]
    for name, image in result.aovs.items():
        assert (image == plain.aovs[name]).all()
    depth = prepare(scene_file(integrator='<integrator type="depth"/>')).render()
    assert (depth.image == plain.aovs["depth"][..., None]).all()
    assert depth.aovs == {} and depth.image.max() > 0


def test_files_are_found_by_the_path_of_a_scene(tmp_path: Path) -> None:
    (tmp_path / "common").mkdir()
    (tmp_path / "common" / "square.ply").write_bytes(scene_files.ply_bytes())
    (tmp_path / "scenes").mkdir()
    path = tmp_path / "scenes" / "scene.xml"
    mesh = scene_files.mesh_shape("square.ply")
    path.write_text(scene_files.scene_xml(shapes=mesh, extra='<path value="../common"/>'))
    assert len(import_scene(path).faces) == 2
    path.write_text(scene_files.scene_xml(shapes=mesh))
    with pytest.raises(SceneError, match="check the path"):
        import_scene(path)


def test_plugin_scenes_are_told_apart(tmp_path: Path) -> None:
    for name in ("native", "plastics"):
        path = tmp_path / f"{name}.xml"
        path.write_text(plugin_scenes.SCENES[name])
        expected = "native" if name == "native" else "mitsuba"
        assert choose_shading(path).path == expected
