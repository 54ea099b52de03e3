"""Files of trees, meshes and scenes with random damage."""

from __future__ import annotations

import functools
import json
import re
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scene_files
import tree_file_parts
from fuzz_cases import soup
from fuzz_process import FuzzProcess
from hypothesis import given, settings
from hypothesis import strategies as st

from mlrt_plugin import KdTree

FUZZ = settings.get_profile("fuzz")
WORDS = st.one_of(
    st.sampled_from([0, 1, 3, 7, 2**8 - 1, 2**24, 2**31 - 1, 2**31, 2**32 - 1, 2**32 - 8]),
    st.integers(0, 400),
    st.integers(0, 2**32 - 1),
)


@functools.cache
def tree_bytes() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tree"
        KdTree(*soup()).save(path)
        return path.read_bytes()


@st.composite
def damaged(draw: Any, data: bytes) -> bytes:
    """Some bytes set, cut out, doubled or put in."""
    result = bytearray(data)
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, max(len(result) - 1, 0)))
        length = draw(st.integers(1, 12))
        match draw(st.sampled_from(["set", "cut", "double", "insert", "end"])):
            case "set":
                new = draw(st.binary(min_size=length, max_size=length))
                result[at : at + length] = new
            case "cut":
                del result[at : at + length]
            case "double":
                result[at:at] = result[at : at + length]
            case "insert":
                result[at:at] = draw(st.binary(max_size=8))
            case "end":
                del result[at:]
    return bytes(result)


@given(st.data())
@settings(FUZZ)
def test_damaged_tree_files(process: FuzzProcess, data: st.DataObject) -> None:
    process("tree_file", data.draw(damaged(tree_bytes())))


@st.composite
def forged_trees(draw: Any) -> bytes:
    """Files with the right checksum and wrong nodes, references or figures."""
    parts = tree_file_parts.split(tree_bytes())
    nodes, references = parts.nodes.copy(), parts.references.copy()
    for _ in range(draw(st.integers(1, 6))):
        index = draw(st.integers(0, len(nodes) - 1))
        match draw(st.sampled_from(["payload", "info", "reference", "swap", "cut"])):
            case "payload":
                nodes[index, 0] = draw(WORDS)
            case "info":
                kind = draw(st.integers(0, 3))
                nodes[index, 1] = (draw(WORDS) << 2 | kind) & 0xFFFFFFFF
            case "reference":
                references[draw(st.integers(0, len(references) - 1))] = draw(WORDS)
            case "swap":
                other = draw(st.integers(0, len(nodes) - 1))
                nodes[[index, other]] = nodes[[other, index]]
            case "cut":
                nodes = nodes[: max(index, 1)]
    parts = parts.but(nodes=nodes, references=references)
    if draw(st.booleans()):
        key = draw(st.sampled_from(sorted(parts.given["report"])))
        value = draw(st.sampled_from([0, -1, 1e300, 2**64, "x", None, [], {}, True]))
        parts = parts.with_report(**{key: value})
    return tree_file_parts.join(parts)


@given(forged_trees())
@settings(FUZZ)
def test_forged_tree_files(process: FuzzProcess, data: bytes) -> None:
    process("tree_file", data)


def text_damage(text: str) -> st.SearchStrategy[str]:
    """Numbers replaced by odd ones, lines lost, doubled or swapped."""
    numbers = [match.span() for match in re.finditer(r"-?\d+(\.\d+)?", text)]
    odd = st.sampled_from(
        [
            "0",
            "-1",
            "nan",
            "inf",
            "1e39",
            "1e-45",
            "-1e30",
            "4294967295",
            "2147483648",
            "",
            "x",
        ]
    )

    @st.composite
    def draw_damage(draw: Any) -> str:
        result = text
        chosen = draw(st.lists(st.sampled_from(numbers), max_size=3, unique=True))
        for begin, end in sorted(chosen, reverse=True):
            result = result[:begin] + draw(odd) + result[end:]
        lines = result.split("\n")
        for _ in range(draw(st.integers(0, 2))):
            at = draw(st.integers(0, len(lines) - 1))
            match draw(st.sampled_from(["lose", "double", "swap", "keep"])):
                case "lose" if len(lines) > 1:
                    del lines[at]
                case "double":
                    lines.insert(at, lines[at])
                case "swap":
                    other = draw(st.integers(0, len(lines) - 1))
                    lines[at], lines[other] = lines[other], lines[at]
        return "\n".join(lines)

    return draw_damage()


def scene_with(mesh: str) -> bytes:
    return scene_files.scene_xml(shapes=scene_files.mesh_shape(mesh)).encode()


BINARY_PLY = scene_files.ply_bytes()
MESHES = {
    "mesh.ply": damaged(BINARY_PLY),
    "header.ply": text_damage(BINARY_PLY.split(b"end_header\n")[0].decode()).map(
        lambda text: text.encode() + b"end_header\n" + BINARY_PLY.split(b"end_header\n")[1]
    ),
    "text.ply": text_damage(scene_files.ply_bytes(text=True).decode()).map(str.encode),
    "mesh.obj": text_damage(scene_files.OBJ).map(str.encode),
    "mesh.serialized": damaged(scene_files.serialized_bytes()),
}


@given(st.data())
@settings(FUZZ)
def test_damaged_meshes(process: FuzzProcess, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(sorted(MESHES)))
    process("scene_file", {"scene.xml": scene_with(name), name: data.draw(MESHES[name])})


SCENE = scene_files.scene_xml(
    shapes=scene_files.FLOOR + "\n" + scene_files.mesh_shape("mesh.ply"),
    emitters=scene_files.LAMP
    + """
<shape type="rectangle" id="panel"><emitter type="area">
    <rgb name="radiance" value="3, 2, 1"/></emitter><transform name="to_world">
    <scale value="0.5"/><translate z="2.5"/></transform></shape>
<emitter type="spot" id="beam"><float name="cutoff_angle" value="30"/>
    <transform name="to_world"><lookat origin="1, 1, 3" target="0, 0, 0" up="0, 1, 0"/>
    </transform></emitter>
<emitter type="directional" id="sun"><vector name="direction" value="0.1, 0.2, -1"/>
    </emitter>""",
)
PLUGINS = st.sampled_from(
    ["cube", "rectangle", "sphere", "diffuse", "point", "spot", "area", "ply", "scene", ""]
)


@st.composite
def scenes(draw: Any) -> bytes:
    text = draw(text_damage(SCENE))
    types = [match.span(1) for match in re.finditer(r'type="(\w+)"', text)]
    if types and draw(st.integers(0, 3)) == 0:
        begin, end = draw(st.sampled_from(types))
        text = text[:begin] + draw(PLUGINS) + text[end:]
    data = text.encode()
    return draw(damaged(data)) if draw(st.integers(0, 3)) == 0 else data


@given(scenes())
@settings(FUZZ)
def test_damaged_scenes(process: FuzzProcess, data: bytes) -> None:
    # A film of any size may be asked for: sizes that take long are not what is tested.
    process("scene_file", {"scene.xml": data, "mesh.ply": BINARY_PLY})


ARGUMENTS = st.fixed_dictionaries(
    {},
    optional={
        "spp": st.sampled_from([1, 2, 0, -1, 2**32, 1.5, "4", None, True, np.int64(2)]),
        "seed": st.sampled_from([0, 2**32 - 1, 2**32, -1, 0.5, None, "1"]),
        "sensor": st.sampled_from([0, 1, -1, "0", None, 1.5, [], {}]),
        "threads": st.sampled_from([1, 2, 0, -1, 10**6, None, "2", 1.5]),
        "aovs": st.sampled_from([(), ["depth"], "depth", ["x"], ["prim", "prim"], 3, [3]]),
        "shadow_offset": st.sampled_from(["robust", "mitsuba", "x", "", 3, None, []]),
        "resolution": st.sampled_from([(4, 3), (0, 1), (-1, 2), (10**9, 10**9), 4, "4x3"]),
        "hide_emitters": st.sampled_from([True, False, None, "yes"]),
        "defines": st.sampled_from([None, {}, {"a": 1}, "a=1", 3]),
        "builder": st.sampled_from(["fast", "lazy", "exact", "x", None, 1]),
        "traversal": st.sampled_from(["single", "packet", "x", None]),
        "progress": st.sampled_from([None, 3, "x"]),
        "tree_cache": st.sampled_from([None, "", 3, "/dev/null/x"]),
        "unknown": st.just(1),
    },
)


@given(ARGUMENTS)
@settings(FUZZ)
def test_arguments_of_render(process: FuzzProcess, arguments: dict[str, Any]) -> None:
    process("render_arguments", arguments)


ELEMENTS = [
    "element face -1\nelement face -1",
    "element face -1",
    "element face 0\nelement face 2",
    f"element face {2**32 - 1}",
    f"element face {2**64}",
]


@pytest.mark.parametrize("elements", ELEMENTS)
def test_numbers_of_rows_that_make_no_sense(process: FuzzProcess, elements: str) -> None:
    """The first was found by chance: of rows without a field NumPy divides by their size,
    which ended the process."""
    mesh = BINARY_PLY.replace(b"element face 2", elements.encode())
    files = {"scene.xml": scene_with("mesh.ply"), "mesh.ply": mesh}
    assert process("scene_file", files).startswith("refused: ")


def test_what_should_be_done_and_refused(process: FuzzProcess) -> None:
    good = {"scene.xml": SCENE.encode(), "mesh.ply": BINARY_PLY}
    assert process("scene_file", good) == "done"
    assert process("scene_file", good | {"mesh.ply": b""}).startswith("refused: ")
    assert process("tree_file", tree_bytes()) == "done"
    assert process("tree_file", tree_bytes()[:-1]).startswith("refused: tree file")
    assert json.loads(tree_file_parts.split(tree_bytes()).description)["report"]
    assert process("render_arguments", {"spp": 1}) == "done"
    assert process("render_arguments", {"spp": 0}).startswith("refused: spp = 0")
