"""What a caller of Scene can get wrong about textures is refused by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import render_scenes
from core_scene import scene_arguments
from object_sets import object_set

from mlrt_plugin._dispatch import core

TEXELS = np.ones(12, np.float32)


def image(**changed: Any) -> dict[str, Any]:
    """A picture of 2 x 2 pixels."""
    right = {
        "type": "bitmap",
        "width": 2,
        "height": 2,
        "channels": 3,
        "wrap": "repeat",
        "texels": TEXELS,
        "decoded": None,
    }
    return right | changed


def attribute(kind: str, count: int, first: int = 0) -> dict[str, Any]:
    return {
        "type": f"{kind}_attribute",
        "first": first,
        "channels": 1,
        "texels": np.ones(count, np.float32),
        "decoded": None,
    }


CONSTANT = {"type": "constant", "colour": [0.1, 0.2, 0.3]}
BOARD = {"type": "checkerboard", "square_0": 0, "square_1": 0}
GOOD: dict[str, list[dict[str, Any]]] = {
    "image": [image()],
    "bytes": [
        image(texels=TEXELS.astype(np.uint8), decoded=np.arange(256, dtype=np.float32))
    ],
    "board": [CONSTANT, BOARD],
    "faces": [attribute("face", 100_000)],
    "vertices": [attribute("vertex", 100_000)],
}
BAD: dict[str, tuple[list[dict[str, Any]], type[Exception], str]] = {
    "image size": ([image(texels=TEXELS[1:])], ValueError, "height x width"),
    "empty image": ([image(width=0, texels=TEXELS[:0])], ValueError, "at least one"),
    "channels": ([image(channels=2)], ValueError, "1 or 3"),
    "infinite texel": ([image(texels=TEXELS * np.inf)], ValueError, "finite"),
    "bytes alone": (
        [image(texels=TEXELS.astype(np.uint8))],
        ValueError,
        "256 finite numbers",
    ),
    "wide texels": (
        [image(texels=TEXELS.astype(np.float64))],
        TypeError,
        "float32 or uint8",
    ),
    "wrap": ([image(wrap="tile")], ValueError, "repeat, mirror, clamp"),
    "board of itself": ([BOARD], ValueError, "square_0"),
    "board of nothing": ([BOARD | {"square_1": None}], ValueError, "square"),
    "unknown field": ([CONSTANT | {"color": 3}], ValueError, "'color'"),
    "few faces": ([attribute("face", 1)], ValueError, r"textures\[0\] has no values"),
    "few vertices": ([attribute("vertex", 3)], ValueError, r"textures\[0\] has no values"),
    "other faces": (
        [attribute("face", 100_000, 1)],
        ValueError,
        r"textures\[0\] has no values",
    ),
}


def arguments_with(folder: Path, textures: list[dict[str, Any]]) -> dict[str, Any]:
    """A scene all of whose materials have the last of the textures on both sides."""
    arguments = scene_arguments(render_scenes.several_lights(folder))
    count = len(arguments["materials"])
    numbers = np.full((count, 3), len(textures) - 1, np.uint32)
    return arguments | {"textures": textures, "material_textures": numbers}


@pytest.mark.parametrize("name", GOOD)
def test_good_textures(folder: Path, name: str) -> None:
    scene = core.Scene(**arguments_with(folder, GOOD[name]))
    assert core.render(scene, 1)["image"].max() > 0


@pytest.mark.parametrize("name", BAD)
def test_bad_textures(folder: Path, name: str) -> None:
    textures, error, message = BAD[name]
    with pytest.raises(error, match=message) as caught:
        core.Scene(**arguments_with(folder, textures))
    assert "\n" not in str(caught.value)


def test_numbers_of_textures(folder: Path) -> None:
    arguments = arguments_with(folder, [CONSTANT])
    arguments["material_textures"][2, 1] = 7
    with pytest.raises(ValueError, match=r"material_textures\[2\] refers to texture 7"):
        core.Scene(**arguments)
    arguments["material_textures"] = arguments["material_textures"][:2]
    with pytest.raises(ValueError, match=r"\(M, 3\)"):
        core.Scene(**arguments)


def test_coordinates(folder: Path) -> None:
    arguments = arguments_with(folder, [CONSTANT])
    arguments["shapes"][0]["texture_coordinates"] = True
    with pytest.raises(ValueError, match="texture coordinates of vertex"):
        core.Scene(**arguments)
    arguments["uvs"] = np.full((100_000, 2), np.nan, np.float32)
    with pytest.raises(ValueError, match=r"uvs\[0\] must be finite"):
        core.Scene(**arguments)
    arguments["uvs"] = np.zeros((100_000, 2), np.float32)
    core.Scene(**arguments)


def test_textures_need_faces(folder: Path) -> None:
    arguments = scene_arguments(render_scenes.SCENES["mesh flat"](folder))
    arguments["faces"] = np.zeros((0, 3), np.uint32)
    arguments["normals"] = np.zeros((0, 3), np.float32)
    for shape in arguments["shapes"]:
        shape["vertex_normals"] = False
    count = len(arguments["materials"])
    arguments["textures"] = [CONSTANT]
    arguments["material_textures"] = np.zeros((count, 3), np.uint32)
    with pytest.raises(ValueError, match="has textures, but faces are empty"):
        core.Scene(**arguments)


def test_attributes_need_faces_of_the_tree(folder: Path) -> None:
    count = sum(
        shape["face_count"] for shape in arguments_with(folder, [CONSTANT])["shapes"]
    )
    values = np.ones((count + 1, 3), np.float32)
    attribute = {
        "type": "face_attribute",
        "first": 0,
        "channels": 3,
        "texels": values,
        "decoded": None,
    }
    arguments = arguments_with(folder, [attribute])
    ball = {"first_face": count, "face_count": 1, "material": 0}
    arguments["shapes"] = [*arguments["shapes"], ball]
    arguments["objects"] = object_set([0], [np.eye(3, 4)], first_face=count)
    message = "shows an attribute, but its faces are not in the tree"
    with pytest.raises(ValueError, match=message):
        core.Scene(**arguments)
    core.Scene(**arguments | {"material_textures": None})
