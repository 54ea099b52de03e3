"""What a caller of Scene and render can get wrong is refused by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import render_scenes
from core_scene import core_scene, scene_arguments

from mlrt_plugin._dispatch import core

Arguments = dict[str, Any]


def changed(path: str, value: Any) -> Callable[[Arguments], None]:
    """Sets an entry such as ``shapes.0.material``; the value ``KeyError`` removes it."""

    def change(arguments: Arguments) -> None:
        target: Any = arguments
        *folders, last = path.split(".")
        for name in folders:
            target = target[int(name) if name.isdecimal() else name]
        key = int(last) if last.isdecimal() else last
        if value is KeyError:
            del target[key]
        else:
            target[key] = value

    return change


def last_face_of_normals(arguments: Arguments) -> None:
    arguments["faces"] = arguments["faces"].copy()
    arguments["faces"][-1, 2] = 100_000


def two_skies(arguments: Arguments) -> None:
    arguments["emitters"][:2] = [{"type": "constant", "radiance": [1, 1, 1]}] * 2


BAD: dict[str, tuple[Callable[[Arguments], None], type[Exception], str]] = {
    "missing key": (changed("camera.axes", KeyError), ValueError, r"camera lacks 'axes'"),
    "unknown key": (changed("film.widht", 3), ValueError, r"film has no field 'widht'"),
    "not a dict": (changed("emitters.0", 3), TypeError, r"emitters\[0\] must be a dict"),
    "unknown name": (
        changed("emitters.0.type", "sun"),
        ValueError,
        r"point, spot, projector, directional",
    ),
    "not a number": (changed("camera.near_clip", "x"), TypeError, r"'near_clip'.*number"),
    "not finite": (changed("emitters.0.radiance", [1, np.nan, 1]), ValueError, "finite"),
    "too large": (changed("camera.far_clip", 1e300), ValueError, "finite in single"),
    "two of three": (changed("camera.origin", [1, 2]), ValueError, "must have 3 elements"),
    "not a sequence": (changed("camera.origin", 1), TypeError, "must be a sequence"),
    "skewed axes": (changed("camera.axes", np.ones((3, 3))), ValueError, "orthogonal"),
    "clip planes": (changed("camera.far_clip", 0), ValueError, "'far_clip'"),
    "no field of view": (changed("camera.tan_half_fov_x", 0), ValueError, "positive"),
    "crop outside": (changed("film.crop_x", 1), ValueError, "crop"),
    "crop wraps": (changed("film.crop_width", 2**32 - 1), ValueError, "from 0 to"),
    "empty film": (changed("film.crop_height", 0), ValueError, "crop"),
    "negative size": (changed("film.width", -1), ValueError, "from 0 to"),
    "half a pixel": (changed("film.width", 10.5), TypeError, "integer"),
    "filter radius": (changed("film.filter_radius", 1000), ValueError, "16 pixels"),
    "material index": (
        changed("shapes.1.material", 99),
        ValueError,
        r"shapes\[1\]\['material'",
    ),
    "emitter index": (
        changed("shapes.1.emitter", 5),
        ValueError,
        r"shapes\[1\]\['emitter'",
    ),
    "gap in faces": (
        changed("shapes.1.first_face", 9),
        ValueError,
        r"shapes\[1\] must begin",
    ),
    "too few faces": (changed("shapes.5.face_count", 1), ValueError, "shapes cover"),
    "too many faces": (
        changed("shapes.0.face_count", 2**32 - 1),
        ValueError,
        "shapes cover",
    ),
    "wrong emitter": (changed("shapes.0.emitter", 0), ValueError, r"shapes\[0\] glows"),
    "no shape": (changed("emitters.3.shape", None), ValueError, "shape that glows"),
    "other shape": (changed("emitters.3.shape", 0), ValueError, "emitter"),
    "spot angles": (changed("emitters.1.beam_width", 3), ValueError, "cut-off"),
    "long direction": (
        changed("emitters.1.direction", [0, 0, 2]),
        ValueError,
        "unit length",
    ),
    "negative weight": (changed("emitters.0.sampling_weight", -1), ValueError, "negative"),
    "faces shape": (
        changed("faces", np.zeros(3, np.uint32)),
        ValueError,
        r"faces.*\(N, 3\)",
    ),
    "faces count": (
        changed("faces", np.zeros((3, 3), np.uint32)),
        ValueError,
        "faces has 3",
    ),
    "normal index": (last_face_of_normals, ValueError, "refers to normal 100000"),
    "no normals": (changed("normals", np.zeros((0, 3), np.float32)), ValueError, "normals"),
    "materials shape": (
        changed("materials", np.zeros((2, 3), np.float32)),
        ValueError,
        r"\(M, 2, 3\)",
    ),
    "no width": (changed("camera.half_extent", [0, 1]), ValueError, "'half_extent'"),
    "unknown camera": (changed("camera.type", "fisheye"), ValueError, "perspective, thin"),
    "lens without size": (
        changed("camera.type", "thinlens"),
        ValueError,
        "camera lacks 'aperture_radius'",
    ),
    "negative lens": (
        changed("camera.aperture_radius", -1),
        ValueError,
        "must not be negative",
    ),
    "no focus": (changed("camera.focus_distance", 0), ValueError, "'focus_distance'"),
    "picture without a sky": (
        changed("environment", np.zeros((3, 2, 3), np.float32)),
        ValueError,
        "if and only if",
    ),
    "sky without a picture": (
        changed("emitters.0", {"type": "envmap", "radiance": [1, 1, 1]}),
        ValueError,
        "if and only if",
    ),
    "two skies": (two_skies, ValueError, "at most one"),
    "flat sky": (
        changed("emitters.0.axes", [[1, 0, 0], [0, 1, 0], [1, 1, 0]]),
        ValueError,
        "linearly independent",
    ),
    "picture shape": (
        changed("environment", np.zeros((2, 2, 3), np.float32)),
        ValueError,
        r"\(H, W, 3\)",
    ),
    "picture of NaN": (
        changed("environment", np.full((3, 2, 3), np.nan, np.float32)),
        ValueError,
        "finite",
    ),
    "dark material": (
        changed("materials", np.full((6, 2, 3), -1, np.float32)),
        ValueError,
        "not negative",
    ),
}


def test_too_many_pixels(folder: Path) -> None:
    arguments = scene_arguments(render_scenes.SCENES["point"](folder))
    arguments["film"] = {"width": 65536, "height": 65536, "filter": "box"}
    with pytest.raises(ValueError, match=r"2\^31 pixels"):
        core.Scene(**arguments)


def test_a_scene_without_faces_is_black(folder: Path) -> None:
    arguments = scene_arguments(render_scenes.SCENES["directional"](folder))
    none = np.zeros((0, 3), np.uint32)
    arguments |= {
        "tree": core.KdTree(np.zeros((0, 3), np.float32), none),
        "faces": none,
        "shapes": [],
    }
    answer = core.render(core.Scene(**arguments), 2, 0, {}, ["depth", "prim"])
    assert not answer["image"].any()
    assert not answer["aovs"]["depth"].any()
    assert (answer["aovs"]["prim"] == -1).all()


@pytest.mark.parametrize("name", BAD)
def test_bad_scene(folder: Path, name: str) -> None:
    change, error, message = BAD[name]
    arguments = scene_arguments(render_scenes.several_lights(folder))
    core.Scene(**arguments)
    change(arguments)
    with pytest.raises(error, match=message) as caught:
        core.Scene(**arguments)
    assert "\n" not in str(caught.value)


BAD_RENDERS: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "no samples": ({"spp": 0}, ValueError, "at least 1"),
    "negative samples": ({"spp": -1}, TypeError, "render"),
    "unknown option": ({"options": {"its": 3}}, ValueError, "options has no field 'its'"),
    "unknown traversal": (
        {"options": {"traversal": "x"}},
        ValueError,
        "brute_force, single",
    ),
    "tiles": (
        {"options": {"initial_tile": 16, "minimum_tile": 32}},
        ValueError,
        "must not exceed",
    ),
    "no tile": ({"options": {"minimum_tile": 0}}, ValueError, "positive"),
    "split": ({"options": {"split_factor": 5}}, ValueError, "4 or 16"),
    "unknown picture": ({"aovs": ["albedo"]}, ValueError, "'albedo'"),
    "progress": ({"progress": 3}, TypeError, "callable"),
    "unknown sampler": ({"sampler": {"type": "sobol"}}, ValueError, "independent, strat"),
    "samples of a sampler": (
        {"sampler": {"type": "stratified"}, "spp": 3},
        ValueError,
        "spp = 3",
    ),
    "too many samples": (
        {"sampler": {"type": "ldsampler"}, "spp": 1 << 28},
        ValueError,
        "32 bits",
    ),
    "emitter samples": ({"emitter_samples": 257}, ValueError, "at most 256"),
    "BSDF samples": ({"bsdf_samples": 257}, ValueError, "at most 256"),
}


@pytest.mark.parametrize("name", BAD_RENDERS)
def test_bad_render(folder: Path, name: str) -> None:
    arguments, error, message = BAD_RENDERS[name]
    scene = core_scene(render_scenes.SCENES["point"](folder))
    with pytest.raises(error, match=message):
        core.render(scene, **({"spp": 1} | arguments))
