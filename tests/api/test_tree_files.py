"""Trees that are saved and loaded again, and files that are refused."""

from __future__ import annotations

import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tree_file_parts
import workloads
from kd_trees import BuiltTree
from tree_file_parts import Parts

from mlrt_plugin import KdTree, MlrtError, MlrtWarning, TreeFileError
from mlrt_plugin._dispatch import core

SEED = 20261122
Saved = tuple[Path, workloads.Scene]


def scene_of(count: int) -> workloads.Scene:
    return workloads.soup(np.random.default_rng(SEED), count)


def one_triangle() -> workloads.Scene:
    return scene_of(1)


@pytest.fixture
def saved(tmp_path: Path) -> Saved:
    scene = scene_of(60)
    path = tmp_path / "soup.kdtree"
    KdTree(*scene).save(path)
    return path, scene


def refusal(path: Path, scene: workloads.Scene, **options: Any) -> str:
    """Why a file is refused, after its name."""
    with pytest.raises(TreeFileError) as caught:
        KdTree.load(path, *scene, **options)
    message = str(caught.value)
    start = f"tree file '{path}' "
    assert message.startswith(start)
    assert "\n" not in message
    return message.removeprefix(start)


SCENES: dict[str, Callable[[], workloads.Scene]] = {
    "empty": lambda: (np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)),
    "one triangle": one_triangle,
    "soup": lambda: scene_of(500),
    "box": workloads.box,
    "flat": lambda: workloads.flat(np.random.default_rng(SEED)),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    "options",
    [{}, {"builder": "fast"}, {"clip": False, "area_floor": 0.01, "max_depth": 9}],
    ids=["", "fast", "other"],
)
def test_round_trip(name: str, options: dict[str, Any], tmp_path: Path) -> None:
    scene = SCENES[name]()
    path = tmp_path / "tree"
    built = KdTree(*scene, **options)
    built.save(path)
    loaded = KdTree.load(path, *scene, **options)
    assert loaded.report == built.report
    for arrays in (core.tree_nodes, core.tree_references, core.tree_triangles):
        assert arrays(loaded._tree).tobytes() == arrays(built._tree).tobytes()
    assert loaded._tree.bounds == built._tree.bounds
    origins, directions = np.random.default_rng(SEED + 1).normal(size=(2, 500, 3))
    for a, b in zip(
        built.closest_hit(origins, directions),
        loaded.closest_hit(origins, directions),
        strict=True,
    ):
        assert a.tobytes() == b.tobytes()
    loaded.save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == path.read_bytes()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again", "tree"]


@pytest.mark.parametrize("used", [False, True], ids=["", "used before"])
def test_a_lazy_tree_is_finished_and_saved(used: bool, tmp_path: Path) -> None:
    scene = scene_of(2000)
    path = tmp_path / "tree"
    origins, directions = np.random.default_rng(SEED + 2).normal(size=(2, 400, 3))
    lazy, fast = KdTree(*scene, builder="lazy"), KdTree(*scene, builder="fast")
    expected = fast.closest_hit(origins, directions)
    if used:
        lazy.closest_hit(origins[:5], directions[:5])
        assert lazy.report["leaves"] > 0
        assert lazy.report["unbuilt_cells"] > 0
    lazy.save(path)
    assert lazy.report["built_share"] == 1
    for builder in ("lazy", "fast"):
        loaded = KdTree.load(path, *scene, builder=builder)
        assert loaded.report == lazy.report
        for a, b in zip(expected, loaded.closest_hit(origins, directions), strict=True):
            assert a.tobytes() == b.tobytes()
    # The same tree but for the order of its nodes.
    for name in ("nodes", "leaves", "empty_leaves", "references", "depth"):
        assert lazy.report[name] == fast.report[name]
    assert lazy.report["sah_cost"] == pytest.approx(fast.report["sah_cost"], rel=1e-9)
    assert "builder is fast, not exact" in refusal(path, scene, builder="exact")


def test_an_unbuilt_node_is_refused(saved: Saved) -> None:
    path, scene = saved
    parts = tree_file_parts.split(path.read_bytes())
    marked = parts.with_node(0, 0, 1 << 8 | 1 << 2 | 3)
    path.write_bytes(tree_file_parts.join(marked))
    assert refusal(path, scene) == "is malformed: node 0 is not built"


def test_faces_that_are_left_out_are_told_of_when_loading(tmp_path: Path) -> None:
    vertices, faces = scene_of(30)
    vertices[faces[4, 1], 2] = np.nan
    with pytest.warns(MlrtWarning, match="first of them face 4"):
        tree = KdTree(vertices, faces)
    tree.save(tmp_path / "tree")
    with pytest.warns(MlrtWarning, match="first of them face 4") as caught:
        KdTree.load(tmp_path / "tree", vertices, faces)
    assert caught[0].filename == __file__


def test_the_file_is_as_described(saved: Saved) -> None:
    path, (vertices, faces) = saved
    parts = tree_file_parts.split(path.read_bytes())
    expected = BuiltTree(vertices[faces])
    is_leaf = parts.nodes[:, 1] & 3 == 3
    assert (parts.nodes[:, 1] & 3 == expected.axis).all()
    assert (parts.nodes[~is_leaf, 1] >> 2 == expected.child[~is_leaf]).all()
    splits = expected.split[~is_leaf].view(np.uint32)
    assert (parts.nodes[~is_leaf, 0] == splits).all()
    assert (parts.nodes[is_leaf, 0] == expected.first_reference[is_leaf]).all()
    assert (parts.nodes[is_leaf, 1] >> 8 == expected.count[is_leaf]).all()
    assert (parts.references == expected.references).all()
    assert tree_file_parts.join(parts) == path.read_bytes()


def test_triangles_count_and_not_how_they_are_indexed(saved: Saved) -> None:
    path, (vertices, faces) = saved
    renumbered = vertices[::-1], (len(vertices) - 1 - faces).astype(np.uint32)
    assert (
        KdTree.load(path, *renumbered).report == KdTree.load(path, vertices, faces).report
    )


def test_other_geometry(saved: Saved) -> None:
    path, (vertices, faces) = saved
    moved = vertices.copy()
    moved[17, 1] = np.nextafter(moved[17, 1], np.float32(2))
    swapped = faces[[1, 0, *range(2, len(faces))]]
    turned = faces[:, [1, 2, 0]]
    for other in (
        (moved, faces),
        (vertices, swapped),
        (vertices, turned),
        (vertices, faces[:-1]),
        (vertices, np.concatenate([faces, faces[:1]])),
    ):
        assert refusal(path, other) == "holds the tree of other geometry"


OTHER_OPTIONS: dict[str, Any] = {
    "traversal_cost": 1.25,
    "intersection_cost": 2.0,
    "empty_bonus": 0.5,
    "clip": False,
    "rule_empty_cell": False,
    "rule_flat_cell": False,
    "rule_area_floor": False,
    "empty_cell_share": 0.2,
    "area_floor": 0.001,
    "max_depth": 5,
    "builder": "exact",
}


@pytest.mark.parametrize("name", core.build_options())
def test_each_option_counts(name: str, saved: Saved) -> None:
    path, scene = saved
    default = core.build_options()[name]
    expected = f"holds the tree of other build options: {name} is "
    assert refusal(path, scene, **{name: OTHER_OPTIONS[name]}).startswith(expected)
    assert KdTree.load(path, *scene, **{name: default}).report


def test_unknown_option(saved: Saved) -> None:
    path, scene = saved
    with pytest.raises(TypeError, match="unknown option 'speed'"):
        KdTree.load(path, *scene, speed=1)


def test_no_file(tmp_path: Path) -> None:
    assert refusal(tmp_path / "absent", one_triangle()) == "does not exist"
    assert refusal(tmp_path, one_triangle()) == "cannot be read: Is a directory"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert refusal(tmp_path / "pipe", one_triangle()) == "is not a regular file"


@pytest.mark.parametrize(
    "data",
    [b"", b"\0", b"ply\nformat ascii 1.0\n", b"\x89PNG\r\n\x1a\n" + bytes(500)],
)
def test_foreign_files(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "foreign"
    path.write_bytes(data)
    assert refusal(path, one_triangle()) == "is not a file of a tree"


def test_every_flipped_byte_is_noticed(tmp_path: Path) -> None:
    path, scene = tmp_path / "tree", scene_of(3)
    KdTree(*scene).save(path)
    data = bytearray(path.read_bytes())
    rng = random.Random(SEED)
    reasons = []
    for i in range(len(data)):
        flip = rng.choice([0xFF, 1 << rng.randrange(8)])
        data[i] ^= flip
        path.write_bytes(data)
        reasons.append(refusal(path, scene))
        data[i] ^= flip
    path.write_bytes(data)
    assert KdTree.load(path, *scene).report
    assert reasons[:8] == ["is not a file of a tree"] * 8
    assert reasons[8].startswith("has version ")
    assert reasons[12].startswith("is of version ")
    assert reasons[16:48] == ["holds the tree of other geometry"] * 32
    assert all("its header promises" in reason for reason in reasons[48:72])
    assert set(reasons[72:]) == {"is damaged: its checksum is wrong"}


def test_every_truncation_is_noticed(tmp_path: Path) -> None:
    path, scene = tmp_path / "tree", scene_of(3)
    KdTree(*scene).save(path)
    data = path.read_bytes()
    for length in range(len(data)):
        path.write_bytes(data[:length])
        reason = refusal(path, scene)
        assert ("cut off" in reason) == (length > 0)
    path.write_bytes(data + b"\0")
    assert refusal(path, scene).startswith(f"has {len(data) + 1} bytes where its header")


@pytest.mark.parametrize("version", [0, 2, 2**32 - 1])
def test_other_versions(version: int, saved: Saved) -> None:
    path, scene = saved
    parts = tree_file_parts.split(path.read_bytes())
    path.write_bytes(tree_file_parts.join(parts.but(format_version=version)))
    assert refusal(path, scene).startswith(f"has version {version} of the format")
    newer = parts.builder_version + 1 + version % 2**31
    path.write_bytes(tree_file_parts.join(parts.but(builder_version=newer)))
    assert refusal(path, scene).startswith(f"is of version {newer} of the builder")


BAD_DESCRIPTIONS: dict[str, Callable[[Parts], Parts]] = {
    "empty": lambda p: p.but(description=b""),
    "not text": lambda p: p.but(description=b"\xff\xfe{}"),
    "deep": lambda p: p.but(description=b"[" * 100_000),
    "a list": lambda p: p.but(description=b"[]"),
    "no report": lambda p: p.but(description=json.dumps({"options": {}}).encode()),
    "huge": lambda p: p.but(description=b" " * (1 << 21) + p.description),
    "text for a number": lambda p: p.with_report(leaves="many"),
    "negative count": lambda p: p.with_report(leaves=-1),
    "huge count": lambda p: p.with_report(leaves=2**70),
    "missing figure": lambda p: p.but(
        description=json.dumps({**p.given, "report": {}}).encode()
    ),
    "more options": lambda p: p.but(
        description=json.dumps(
            {**p.given, "options": {**p.given["options"], "luck": 1}}
        ).encode()
    ),
}


@pytest.mark.parametrize("name", BAD_DESCRIPTIONS)
def test_bad_descriptions(name: str, saved: Saved) -> None:
    path, scene = saved
    parts = tree_file_parts.split(path.read_bytes())
    path.write_bytes(tree_file_parts.join(BAD_DESCRIPTIONS[name](parts)))
    assert refusal(path, scene)


def test_numbers_that_do_not_add_up(saved: Saved) -> None:
    path, scene = saved
    data = bytearray(path.read_bytes())
    for position in (48, 56, 64):
        for value in (0, 1, 2**31, 2**63, 2**64 - 1):
            changed = data.copy()
            changed[position : position + 8] = value.to_bytes(8, "little")
            path.write_bytes(changed)
            assert "bytes where its header promises" in refusal(path, scene)


def test_saving_where_nothing_can_be_written(tmp_path: Path) -> None:
    tree = KdTree(*one_triangle())
    for path in (tmp_path / "absent" / "tree", tmp_path):
        with pytest.raises(MlrtError, match="cannot be written: ") as caught:
            tree.save(path)
        assert str(caught.value).startswith(f"tree file '{path}' ")
    assert list(tmp_path.iterdir()) == []
