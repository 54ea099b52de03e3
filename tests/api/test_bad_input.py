"""Scenes that cannot be rendered: one sentence each, and never a crash."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import pytest
import scene_files

from mlrt_plugin import MlrtError, SceneError, UnsupportedFeature, import_scene
from mlrt_plugin.parsing import reported

SceneFile = Callable[..., Path]


def message_of(error: pytest.ExceptionInfo[MlrtError]) -> str:
    text = str(error.value)
    assert "\n" not in text
    assert "\x1b" not in text
    assert ".cpp" not in text
    return text


def film(width: object, height: object) -> dict[str, str]:
    text = scene_files.SENSOR.replace('value="16"', f'value="{width}"')
    return {"sensor": text.replace('value="12"', f'value="{height}"')}


def moved_floor(transform: str) -> dict[str, str]:
    return {
        "shapes": '<shape type="rectangle" id="floor"><transform name="to_world">'
        f"{transform}</transform></shape>"
    }


SCENES = {
    "no shapes": ({"shapes": ""}, "no shapes"),
    "no emitter": ({"emitters": ""}, "no emitter"),
    "no sensor": ({"sensor": ""}, "no sensor"),
    "unknown plugin": ({"shapes": '<shape type="nonsense" id="x"/>'}, "'nonsense'.*'x'"),
    "unknown element": ({"extra": "<foo/>"}, "<foo>"),
    "unclosed element": ({"extra": '<shape type="cube">'}, "line"),
    "area light of no shape": (
        {"emitters": '<emitter type="area" id="lost"/>'},
        "no emitter",
    ),
    "unknown property": (
        {"shapes": '<shape type="cube"><float name="size" value="1"/></shape>'},
        "size",
    ),
    "bad number": (
        {"shapes": '<shape type="cube"><float name="size" value="big"/></shape>'},
        "big",
    ),
    "objects where none belong": (
        {
            "emitters": '<emitter type="point" id="x"><emitter type="directional"/>'
            '<shape type="rectangle"><bsdf type="diffuse"/></shape></emitter>'
        },
        r'"point": - object "_arg_0": DirectionalEmitter - object "_arg_1": Rectangle;',
    ),
    "bad reference": ({"shapes": '<shape type="cube"><ref id="nope"/></shape>'}, "nope"),
    "undefined parameter": ({"extra": '<bsdf type="$kind"/>'}, "kind"),
    "film without width": (film(0, 12), "width = 0"),
    "film of negative height": (film(16, -5), "height = -5"),
    "flattening": (moved_floor('<scale x="0"/>'), "'floor'.*singular"),
    "not a number": (moved_floor('<translate x="nan"/>'), "'floor'.*NaN"),
    "infinite": (moved_floor('<scale value="inf"/>'), "'floor'.*NaN or infinite"),
    "overflow": (moved_floor('<scale value="1e38"/><scale value="1e3"/>'), "'floor'"),
    "colour": (
        {"emitters": scene_files.LAMP.replace("8, 7, 6", "8, nan, 6")},
        "'lamp'.*NaN",
    ),
    "lamp nowhere": (
        {"emitters": scene_files.LAMP.replace("1, 2, 3", "1, inf, 3")},
        "'lamp'.*position",
    ),
    "field of view": (
        {
            "sensor": scene_files.SENSOR.replace(
                "<sampler", '<float name="fov" value="nan"/><sampler'
            )
        },
        "field of view",
    ),
    "clipping": (
        {
            "sensor": scene_files.SENSOR.replace(
                "<sampler", '<float name="near_clip" value="1e6"/><sampler'
            )
        },
        "near_clip",
    ),
    "filter": (
        {
            "sensor": scene_files.SENSOR.replace(
                'type="box"/>',
                'type="gaussian"><float name="stddev" value="-1"/></rfilter>',
            )
        },
        "radius of -4",
    ),
    "spot": (
        {
            "emitters": '<emitter type="spot" id="x"><float name="beam_width" value="3e1"/>'
            "</emitter>"
        },
        "'x'.*beam_width = 30",
    ),
    "huge film": (film(10**6, 10**6), "1000000x1000000"),
    "crop outside": (
        film(16, '12"/><integer name="crop_width" value="99'),
        "'hdrfilm': Invalid crop window.*make the crop window lie within the film",
    ),
    "crop before the film": (
        film(16, '12"/><integer name="crop_offset_x" value="-4'),
        "crop_offset_x.*-4 is out of bounds.*choose a value within",
    ),
    "circular reference": (
        {"extra": '<bsdf type="twosided" id="a"><ref id="a"/></bsdf>'},
        "circular",
    ),
    "scaling camera": (
        {"sensor": scene_files.SENSOR.replace("<lookat", '<scale x="2"/><lookat')},
        "[Ss]cale",
    ),
}


@pytest.mark.parametrize("name", SCENES)
def test_bad_scenes(scene_file: SceneFile, name: str) -> None:
    parts, expected = SCENES[name]
    with pytest.raises(SceneError, match=expected) as caught:
        import_scene(scene_file(**parts))
    message_of(caught)


PLY = scene_files.ply_bytes()
NAN = float("nan")
MESHES = {
    "missing.ply": (None, "missing.ply"),
    "missing.obj": (None, "missing.obj"),
    "missing.serialized": (None, "missing.serialized"),
    "empty.ply": (b"", "empty.ply"),
    "empty.obj": (b"", "empty.obj"),
    "empty.serialized": (b"", "empty.serialized"),
    "header.ply": (PLY[:60], "header.ply"),
    "truncated.ply": (PLY[:-5], "truncated.ply"),
    "short.ply": (scene_files.ply_bytes(declared_faces=10**6), "short.ply"),
    "text.ply": (scene_files.ply_bytes(text=True)[:-10], "text.ply"),
    "nan.ply": (
        scene_files.ply_bytes([(NAN, 0, 0), *scene_files.SQUARE[1:]]),
        "1 of 4.*nan.ply",
    ),
    "nan-text.ply": (
        scene_files.ply_bytes([(NAN, 0, 0), *scene_files.SQUARE[1:]], text=True),
        "'mesh'.* 1 of 4 vertices with NaN.*nan-text.ply",
    ),
    "quads.ply": (scene_files.ply_bytes(faces=[(0, 1, 3, 2)]), "quads.ply"),
    "index.ply": (scene_files.ply_bytes(faces=[(0, 1, 99999999)]), "vertex 99999999 of 4"),
    "negative.ply": (scene_files.ply_bytes(faces=[(0, 1, -7)]), "vertex -7 of 4"),
    "textindex.ply": (scene_files.ply_bytes(faces=[(0, 1, 4)], text=True), "vertex 4 of 4"),
    "index.serialized": (
        scene_files.serialized_bytes(faces=[(0, 1, 88888888)]),
        "vertex 88888888 of 4",
    ),
    "truncated.serialized": (scene_files.serialized_bytes()[:34], "truncated.serialized"),
    "damaged.serialized": (
        scene_files.serialized_bytes()[:13] + scene_files.serialized_bytes()[14:],
        "damaged.serialized' is damaged or no file of a serialized mesh",
    ),
    "index.obj": (scene_files.OBJ.replace("f 1 2 3", "f 1 2 7").encode(), "vertex 7"),
    "truncated.obj": (
        scene_files.OBJ[:-4].encode(),
        "truncated.obj' ends within its last line 'f 1'",
    ),
    "corner.obj": (
        scene_files.OBJ.encode() + b"vn 0 0 1\nf 1//1 2//1 3/",
        "corner.obj' ends within its last line 'f 1//1 2//1 3/'",
    ),
    "vertices.obj": (b"v 0 0 0\n", "vertices.obj' has no faces"),
    "nan.obj": (scene_files.OBJ.replace("1 0 0", "nan 0 0").encode(), "1 of 3.*nan.obj"),
    "garbage.obj": (bytes(range(256)), "garbage.obj' has no faces"),
}


@pytest.mark.parametrize("name", MESHES)
def test_bad_meshes(scene_file: SceneFile, tmp_path: Path, name: str) -> None:
    content, expected = MESHES[name]
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SceneError, match=expected) as caught:
        import_scene(scene_file(shapes=scene_files.mesh_shape(name)))
    message_of(caught)


def test_defects_of_files_of_a_dictionary(tmp_path: Path) -> None:
    path = tmp_path / "nan.ply"
    path.write_bytes(scene_files.ply_bytes([(0, NAN, 0), *scene_files.SQUARE[1:]]))
    with pytest.raises(SceneError, match=r"'floor' has 1 of 4 .*nan\.ply") as caught:
        import_scene(scene_files.scene_dict(floor={"type": "ply", "filename": str(path)}))
    message_of(caught)


def test_obj_file_without_a_last_line_break(scene_file: SceneFile, tmp_path: Path) -> None:
    (tmp_path / "whole.obj").write_text(scene_files.OBJ.rstrip())
    scene = import_scene(scene_file(shapes=scene_files.mesh_shape("whole.obj")))
    assert len(scene.faces) == 1


@pytest.mark.parametrize("text", ["", "not XML", '<scene version="3.0.0">', "\0\1\2"])
def test_files_that_are_no_scene(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(text)
    with pytest.raises(SceneError, match=r"scene\.xml.*line") as caught:
        import_scene(path)
    message_of(caught)


def test_files_that_hold_something_else(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text('<shape type="cube" version="3.0.0"/>')
    with pytest.raises(SceneError, match="root must be a scene"):
        import_scene(path)
    with pytest.raises(SceneError, match="is a folder"):
        import_scene(tmp_path)
    with pytest.raises(SceneError, match=r"absent\.xml' does not exist"):
        import_scene(tmp_path / "absent.xml")
    with pytest.raises(TypeError, match="not int"):
        import_scene(3)


def test_loaded_object_that_is_no_scene(scalar_variant: None) -> None:
    with pytest.raises(TypeError, match="not a bsdf"):
        import_scene(mi.load_dict({"type": "diffuse"}))


def test_arguments(scene_file: SceneFile) -> None:
    path = scene_file()
    with pytest.raises(SceneError, match=r"unused.*other=3"):
        import_scene(path, defines={"other": 3})
    with pytest.raises(SceneError, match="no sensor 1: it has 1"):
        import_scene(path, sensor=1)
    with pytest.raises(SceneError, match="no sensor -1"):
        import_scene(path, sensor=-1)
    with pytest.raises(SceneError, match="0x8 is too small"):
        import_scene(path, resolution=(0, 8))
    with pytest.raises(SceneError, match="dictionary"):
        import_scene(scene_files.scene_dict(), defines={"a": 1})


def test_crop_keeps_the_resolution(scene_file: SceneFile) -> None:
    crop = '<integer name="crop_width" value="4"/>'
    path = scene_file(sensor=scene_files.SENSOR.replace("<rfilter", crop + "<rfilter"))
    with pytest.raises(SceneError, match="remove the crop"):
        import_scene(path, resolution=(8, 8))


def test_spectral_objects_are_refused(scalar_variant: None) -> None:
    mi.set_variant("scalar_spectral")
    try:
        bsdf = mi.load_dict({"type": "diffuse"})
        scene = mi.load_dict(scene_files.scene_dict())
    finally:
        mi.set_variant("scalar_rgb")
    with pytest.raises(SceneError, match="scalar_spectral"):
        import_scene(scene_files.scene_dict(floor={"type": "rectangle", "bsdf": bsdf}))
    with pytest.raises(SceneError, match="scalar_spectral"):
        import_scene(scene)


def test_integrator_without_such_a_parameter(scene_file: SceneFile) -> None:
    integrator = '<integrator type="mlrt"><integer name="samples" value="1"/></integrator>'
    with pytest.raises(UnsupportedFeature, match=r"integrator 'mlrt'.*'samples'"):
        import_scene(scene_file(integrator=integrator))


def test_interruption_within_mitsuba_is_no_error_of_the_scene(
    scalar_variant: None,
) -> None:
    """Mitsuba turns what is raised in a plugin written in Python into a RuntimeError."""

    class Interrupted(mi.Texture):  # type: ignore[name-defined,misc]
        def __init__(self, props: mi.Properties) -> None:
            raise KeyboardInterrupt

    mi.register_texture("interrupted", Interrupted)
    with pytest.raises(KeyboardInterrupt):
        reported(lambda: mi.load_dict({"type": "interrupted"}), "scene")


def test_all_that_is_not_supported_is_named(scene_file: SceneFile) -> None:
    path = scene_file(
        shapes="""<shape type="sdfgrid" id="ball"><bsdf type="plastic" id="shiny"/></shape>
<shape type="linearcurve" id="hair"/><shape type="linearcurve"/>""",
    )
    with pytest.raises(UnsupportedFeature) as caught:
        import_scene(path)
    text = message_of(caught)
    assert text.startswith(f"shape 'sdfgrid' with id 'ball' at {path} line 13:2 is not")
    assert "bsdf 'plastic' 'shiny' line 13:34;" in text
    assert "shape 'linearcurve' 'hair' line 14:2, line 14:39" in text


def test_integrator_is_named_with_its_place(scene_file: SceneFile) -> None:
    path = scene_file(integrator='<integrator type="path" id="way"/>')
    name = f"integrator 'path' with id 'way' at {path} line 3:2"
    (warning,) = import_scene(path, force_direct=True).warnings
    assert warning.startswith(f"{name}: only direct illumination")
    with pytest.raises(
        UnsupportedFeature, match=r"max_depth = -1.*--force-direct"
    ) as caught:
        import_scene(path)
    assert message_of(caught).startswith(f"{name} asks for more")
