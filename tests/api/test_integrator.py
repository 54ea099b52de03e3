"""The plugin `mlrt` in Mitsuba, in scalar_rgb and llvm_ad_rgb."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files

from mlrt_plugin import SceneError, UnsupportedFeature, prepare, render
from mlrt_plugin.cli import main

SceneFile = Callable[..., Path]

OWN = '<integrator type="mlrt"/>'


def test_image_is_that_of_render(scene_file: SceneFile, scalar_variant: None) -> None:
    other = scene_files.SENSOR.replace('id="eye"', "").replace('value="16"', 'value="20"')
    path = scene_file(integrator=OWN, sensor=scene_files.SENSOR + other)
    scene = mi.load_file(str(path))
    integrator = mi.load_dict({"type": "mlrt"})
    images = [
        mi.render(scene, spp=3, seed=5),
        mi.render(scene, integrator=integrator, spp=3, seed=5),
        mi.render(scene, integrator=integrator, sensor=scene.sensors()[0], spp=3, seed=5),
    ]
    for image in images:
        assert isinstance(image, mi.TensorXf)
        np.testing.assert_array_equal(np.array(image), render(path, spp=3, seed=5).image)
    second = np.array(mi.render(scene, sensor=1))
    np.testing.assert_array_equal(second, render(path, sensor=1).image)
    assert second.shape == (12, 20, 3)
    assert second.max() > 0


def test_sensor_that_is_not_in_the_scene(
    scene_file: SceneFile, scalar_variant: None
) -> None:
    path = scene_file(integrator=OWN)
    scene = mi.load_file(str(path))
    stranger = mi.load_dict(scene_files.scene_dict()["eye"])
    image = np.array(mi.render(scene, sensor=stranger))
    np.testing.assert_array_equal(image, render(scene, sensor=stranger).image)
    assert image.shape == (12, 16, 3)


def test_changes_of_the_scene_are_seen(scene_file: SceneFile, scalar_variant: None) -> None:
    scene = mi.load_file(str(scene_file(integrator=OWN)))
    before = np.array(mi.render(scene))
    parameters = mi.traverse(scene)
    parameters["lamp.intensity.value"] = [16, 14, 12]
    parameters.update()
    np.testing.assert_allclose(np.array(mi.render(scene)), 2 * before, rtol=1e-6)


def test_parameters(scene_file: SceneFile, scalar_variant: None) -> None:
    panel = '<shape type="rectangle"><emitter type="area"/></shape>'
    hidden = (
        '<integrator type="mlrt"><boolean name="hide_emitters" value="true"/></integrator>'
    )
    path = scene_file(integrator=hidden, shapes=panel, emitters="")
    assert np.array(mi.render(mi.load_file(str(path)))).max() == 0
    assert render(path).image.max() == 0
    assert render(path, hide_emitters=False).image.max() == 1
    none = mi.load_dict({"type": "mlrt", "emitter_samples": 0})
    with pytest.raises(SceneError, match="one of them must be at least 1"):
        mi.render(mi.load_file(str(path)), integrator=none)
    both = mi.load_dict({"type": "mlrt", "emitter_samples": 1, "bsdf_samples": 2})
    counts = '<integer name="bsdf_samples" value="2"/>'
    path = scene_file(
        integrator=f'<integrator type="direct">{counts}</integrator>',
        emitters='<emitter type="constant"/>',
    )
    image = np.array(mi.render(mi.load_file(str(path)), integrator=both))
    np.testing.assert_array_equal(image, render(path).image)
    with pytest.raises(RuntimeError, match="shading = 'toon' does not exist"):
        mi.load_dict({"type": "mlrt", "shading": "toon"})
    with pytest.raises(RuntimeError, match="unreferenced"):
        mi.load_dict({"type": "mlrt", "bounces": 1})
    assert "packet" in str(mi.load_dict({"type": "mlrt", "traversal": "packet"}))


def test_options_reach_the_tracer(scene_file: SceneFile, scalar_variant: None) -> None:
    own = '<integrator type="mlrt"><string name="traversal" value="wrong"/></integrator>'
    path = scene_file(integrator=own)
    with pytest.raises(ValueError, match="traversal"):
        render(path)
    with pytest.raises(ValueError, match="traversal"):
        mi.render(mi.load_file(str(path)))


def parameter(tag: str, name: str, value: str) -> str:
    return f'<integrator type="mlrt"><{tag} name="{name}" value="{value}"/></integrator>'


@pytest.mark.parametrize("builder", ["exact", "fast", "lazy"])
def test_options_reach_the_builder(
    builder: str,
    scene_file: SceneFile,
    scalar_variant: None,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = scene_file("own.xml", integrator=parameter("string", "builder", builder))
    expected = render(scene_file("plain.xml")).image
    prepared = prepare(path)
    assert prepared.report["builder"] == builder
    np.testing.assert_array_equal(prepared.render().image, expected)
    scene = mi.load_file(str(path))
    np.testing.assert_array_equal(np.array(mi.render(scene)), expected)
    assert scene.integrator().prepared.report["builder"] == builder
    # What the caller asks for goes first.
    assert prepare(path, builder="exact").report["builder"] == "exact"
    for argv, chosen in ((["tree"], builder), (["tree", "--builder", "fast"], "fast")):
        assert main([argv[0], str(path), *argv[1:], "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["builder"] == chosen


def test_options_of_the_builder_are_checked(
    scene_file: SceneFile, scalar_variant: None
) -> None:
    path = scene_file(integrator=parameter("float", "intersection_cost", "-1"))
    with pytest.raises(ValueError, match="intersection_cost"):
        mi.render(mi.load_file(str(path)))
    # Of paths, as other integrators mean it, not of the tree.
    path = scene_file(integrator=parameter("integer", "max_depth", "2"))
    with pytest.raises(UnsupportedFeature, match="no parameter 'max_depth'"):
        render(path)
    with pytest.raises(RuntimeError, match="unreferenced"):
        mi.load_file(str(path))


def test_unsupported_scene(scene_file: SceneFile, scalar_variant: None) -> None:
    scene = mi.load_file(
        str(
            scene_file(
                integrator=OWN,
                shapes='<shape type="cube"><bsdf type="plastic" id="shiny"/></shape>',
            )
        )
    )
    with pytest.raises(UnsupportedFeature, match=r"[Pp]lastic"):
        mi.render(scene)


SCRIPT = """
import sys
variant, order, path = sys.argv[1:]
if variant.startswith("llvm"):
    from mlrt_compare import llvm
    try:
        llvm.activate()
    except llvm.LlvmUnavailable as error:
        print("no LLVM:", error)
        raise SystemExit
import mitsuba as mi
if order == "before":
    import mlrt_plugin
    mi.set_variant(variant)
else:
    mi.set_variant(variant)
    import mlrt_plugin
import numpy as np
scene = mi.load_file(path)
image = np.array(mi.render(scene, seed=2, spp=3))
integrator = mi.load_dict({"type": "mlrt"})
again = np.array(mi.render(scene, integrator=integrator, seed=2, spp=3))
np.testing.assert_array_equal(again, image)
np.testing.assert_array_equal(mlrt_plugin.render(path, seed=2, spp=3).image, image)
assert image.shape == (12, 16, 3) and image.max() > 0
mi.set_variant("scalar_spectral")
mi.set_variant(variant)
mi.load_dict({"type": "mlrt"})
assert mi.variant() == variant
print("done")
"""


@pytest.mark.parametrize("order", ["before", "after"])
@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_import_before_and_after_the_variant(
    scene_file: SceneFile, variant: str, order: str
) -> None:
    path = scene_file(integrator=OWN)
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, variant, order, str(path)],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=path.parent,
    )
    if run.stdout.startswith("no LLVM"):
        pytest.skip(run.stdout.strip())
    assert (run.returncode, run.stdout) == (0, "done\n"), run.stderr


@pytest.mark.parametrize("crop", [False, True])
def test_image_is_left_in_the_film(
    scene_file: SceneFile, scalar_variant: None, crop: bool
) -> None:
    """As after a rendering by Mitsuba's own integrators."""
    window = {"crop_width": 7, "crop_height": 5, "crop_offset_x": 3, "crop_offset_y": 2}
    properties = "".join(f'<integer name="{k}" value="{v}"/>' for k, v in window.items())
    sensor = scene_files.SENSOR.replace(
        "<rfilter", (properties if crop else "") + "<rfilter"
    )
    scene = mi.load_file(str(scene_file(integrator=OWN, sensor=sensor)))
    image = np.array(mi.render(scene, spp=3))
    film = scene.sensors()[0].film()
    for _ in range(2):
        np.testing.assert_array_equal(np.array(film.develop()), image)
        np.testing.assert_array_equal(
            np.array(film.bitmap(raw=False), np.float32)[..., :3], image
        )
        empty = scene.integrator().render(scene, spp=3, develop=False)
        assert np.array(empty).size == 0


def test_tree_is_built_once_for_the_same_meshes(
    scene_file: SceneFile, scalar_variant: None
) -> None:
    path = scene_file(integrator='<integrator type="path"/>')
    scene = mi.load_file(str(path))
    integrator = mi.load_dict({"type": "mlrt"})
    first = np.array(mi.render(scene, integrator=integrator))
    tree = integrator.prepared.tree
    parameters = mi.traverse(scene)
    parameters["lamp.intensity.value"] = [16, 14, 12]
    parameters.update()
    second = np.array(mi.render(scene, integrator=integrator))
    assert integrator.prepared.tree is tree
    np.testing.assert_allclose(second, 2 * first, rtol=1e-6)
    parameters["floor.to_world"] = mi.ScalarTransform4f().translate([0.7, 0, 0])
    parameters.update()
    third = np.array(mi.render(scene, integrator=integrator))
    assert integrator.prepared.tree is not tree
    assert np.any(third != second)
    fresh = mi.load_dict({"type": "mlrt"})
    np.testing.assert_array_equal(third, np.array(mi.render(scene, integrator=fresh)))


def test_integrator_of_the_scene_does_not_matter(
    scene_file: SceneFile, scalar_variant: None
) -> None:
    """What the scene's own integrator would do is no reason to warn or to refuse."""
    other = (
        '<integrator type="direct"><integer name="emitter_samples" value="0"/></integrator>'
    )
    scene = mi.load_file(str(scene_file(integrator=other)))
    image = np.array(mi.render(scene, integrator=mi.load_dict({"type": "mlrt"})))
    np.testing.assert_array_equal(image, render(scene_file()).image)
