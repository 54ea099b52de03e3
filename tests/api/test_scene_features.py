"""What of a scene is native, approximated or refused, and that all of it is named."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import repository
import scene_files

from mlrt_plugin.errors import UnsupportedFeature
from mlrt_plugin.scene_import import import_scene, summarise

SceneFile = Callable[..., Path]

GLOWING = '<shape type="rectangle"><emitter type="area"/></shape>'


@pytest.mark.parametrize(
    ("parts", "named"),
    [
        ({"integrator": '<integrator type="path"/>'}, "max_depth = -1"),
        ({"integrator": '<integrator type="volpath"/>'}, "participating media"),
        (
            {
                "integrator": '<integrator type="direct">'
                '<integer name="emitter_samples" value="4"/></integrator>'
            },
            "4 times.*as Mitsuba does it",
        ),
    ],
)
def test_approximations_are_named(
    scene_file: SceneFile, parts: dict[str, str], named: str
) -> None:
    (warning,) = import_scene(scene_file(**parts), force_direct=True).warnings
    assert re.search(named, warning)


UNSUPPORTED = {
    "sphere": {
        "shapes": '<shape type="sphere" id="ball"><bsdf type="diffuse">'
        '<texture type="mesh_attribute" name="reflectance">'
        '<string name="name" value="vertex_color"/></texture></bsdf></shape>'
    },
    "shapegroup": {
        "shapes": '<shape type="shapegroup" id="group"><shape type="cube">'
        '<bsdf type="diffuse"><texture type="mesh_attribute" name="reflectance">'
        '<string name="name" value="vertex_color"/></texture></bsdf></shape></shape>'
        '<shape type="instance"><ref id="group"/></shape>'
    },
    "spot": {
        "emitters": '<emitter type="spot"><transform name="to_world"><scale value="2"/>'
        "</transform></emitter>"
    },
    "sdfgrid": {"shapes": '<shape type="sdfgrid" id="ball"/>'},
    "sunsky": {"emitters": '<emitter type="sunsky" id="sky"/>'},
    "volume": {
        "shapes": '<shape type="rectangle"><bsdf type="diffuse">'
        '<texture type="volume" name="reflectance" id="wood">'
        '<volume type="constvolume" name="volume"/></texture></bsdf></shape>'
    },
    "area": {
        "shapes": '<shape type="rectangle"><emitter type="area" id="screen">'
        '<texture type="checkerboard" name="radiance">'
        '<texture type="mesh_attribute" name="color0">'
        '<string name="name" value="vertex_color"/></texture></texture></emitter></shape>'
    },
    "cube": {
        "shapes": '<shape type="cube" id="screen"><emitter type="area">'
        '<texture type="checkerboard" name="radiance"/></emitter></shape>'
    },
    "sphere that is turned": {
        "shapes": '<shape type="sphere" id="screen"><emitter type="area">'
        '<texture type="checkerboard" name="radiance"/></emitter>'
        '<transform name="to_world"><rotate z="1" angle="20"/></transform></shape>'
    },
    "cylinder": {
        "shapes": '<shape type="cylinder" id="screen"><point name="p1" x="1" y="0" z="1"/>'
        '<emitter type="area"><texture type="checkerboard" name="radiance"/></emitter>'
        "</shape>"
    },
    "rectangle": {
        "shapes": '<shape type="rectangle" id="screen"><emitter type="area">'
        '<texture type="checkerboard" name="radiance"/></emitter>'
        '<boolean name="flip_normals" value="true"/></shape>'
    },
    "roughconductor": {
        "shapes": '<shape type="cube"><bsdf type="roughconductor" id="tin"/></shape>'
    },
    "twosided": {
        "shapes": '<shape type="cube"><bsdf type="twosided"><bsdf type="plastic"/></bsdf>'
        "</shape>"
    },
    "mask": {
        "shapes": '<shape type="cube"><bsdf type="mask"><bsdf type="mask">'
        '<bsdf type="diffuse"/></bsdf></bsdf></shape>'
    },
    "orthographic": {
        "sensor": scene_files.SENSOR.replace("perspective", "orthographic").replace(
            "</transform>", '<scale x="2"/><rotate z="1" angle="30"/></transform>'
        )
    },
    "radiancemeter": {"sensor": scene_files.SENSOR.replace("perspective", "radiancemeter")},
    "orthogonal": {
        "sensor": scene_files.SENSOR.replace(
            'type="independent">',
            'type="orthogonal"><integer name="strength" value="3"/>',
        )
    },
    "homogeneous": {
        "shapes": '<shape type="cube"><medium type="homogeneous" name="interior"/></shape>'
    },
}


@pytest.mark.parametrize("plugin", UNSUPPORTED)
def test_unsupported_features_are_named(scene_file: SceneFile, plugin: str) -> None:
    path = scene_file(**UNSUPPORTED[plugin])
    plugin = plugin.partition(" ")[0]
    with pytest.raises(UnsupportedFeature, match=f"'{plugin}'.*scene.xml line") as caught:
        import_scene(path)
    assert "\n" not in str(caught.value)
    features = summarise(path).features
    assert plugin in {f.plugin for f in features if not f.native}


def test_what_is_not_used_does_not_matter(scene_file: SceneFile) -> None:
    import_scene(scene_file(extra='<bsdf type="plastic" id="unused"/>'))


@pytest.mark.parametrize("name", ["cornell-box", "office"])
def test_scenes_of_the_project_are_native(name: str) -> None:
    path = repository.ROOT / "scenes" / name / f"{name}.xml"
    scene = import_scene(path)
    assert all(feature.native for feature in scene.features)
    assert len(scene.faces) == sum(s.face_count for s in scene.shapes)


@pytest.mark.parametrize(
    "name",
    ["bunny/bunny.xml", "toasters/toasters.xml", "living-room/scene_direct.xml"],
)
def test_third_party_scenes_are_native(
    shared_scene: Callable[[str], Path], name: str
) -> None:
    scene = import_scene(shared_scene(name), resolution=(8, 8))
    assert np.isfinite(scene.vertices).all()
    assert scene.warnings == ()


def test_a_summary_serves_once(scene_file: SceneFile) -> None:
    """Loading changes what was parsed: a second time the image would be another."""
    path = scene_file(integrator='<integrator type="direct"/>')
    summary = summarise(path)
    import_scene(path, summary=summary)
    with pytest.raises(RuntimeError, match=r"scene\.xml' was loaded .* parse it anew"):
        import_scene(path, summary=summary)
