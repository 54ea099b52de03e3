"""Trees kept in a folder from one render to the next."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import scene_files

from mlrt_plugin import MlrtWarning, TreeFileError, prepare, render
from mlrt_plugin._dispatch import core

SceneFile = Callable[..., Path]


def files(folder: Path) -> list[Path]:
    return sorted(folder.iterdir()) if folder.is_dir() else []


@pytest.fixture
def scene(scene_file: SceneFile) -> Path:
    return scene_file()


def test_the_second_render_takes_the_tree_of_the_first(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "new" / "cache"
    plain = render(scene)
    first = render(scene, tree_cache=cache)
    assert set(first.timings) == {"load", "find_tree", "build", "save_tree", "render"}
    (path,) = files(cache)
    written = path.read_bytes()

    def fail(*arguments: object, **options: object) -> None:
        raise AssertionError("nothing is to be built")

    monkeypatch.setattr(core, "KdTree", fail)
    second = render(scene, tree_cache=str(cache))
    assert set(second.timings) == {"load", "load_tree", "render"}
    assert plain.image.tobytes() == first.image.tobytes() == second.image.tobytes()
    assert plain.counters == first.counters == second.counters
    assert first.warnings == second.warnings == ()
    assert [p.read_bytes() for p in files(cache)] == [written]


def test_the_report_is_kept(scene: Path, tmp_path: Path) -> None:
    first = prepare(scene, tree_cache=tmp_path / "cache")
    second = prepare(scene, tree_cache=tmp_path / "cache")
    assert "build" not in second.timings
    assert first.report == second.report


def test_without_a_cache_nothing_is_written(scene: Path) -> None:
    assert set(render(scene).timings) == {"load", "build", "render"}
    assert files(scene.parent) == [scene]


def test_what_changes_the_tree_misses_the_cache(
    scene_file: SceneFile, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    moved = scene_files.FLOOR.replace(
        "/>",
        '><transform name="to_world"><translate x="0.25"/></transform></shape>',
    )
    arguments: list[tuple[Path, dict[str, Any]]] = [
        (scene_file("a.xml"), {}),
        (scene_file("b.xml", shapes=moved), {}),
        (scene_file("a.xml"), {"intersection_cost": 2.0}),
        (scene_file("a.xml"), {"rule_flat_cell": False}),
    ]
    for count, (path, options) in enumerate(arguments, 1):
        assert "build" in prepare(path, tree_cache=cache, **options).timings
        assert len(files(cache)) == count
    for path, options in arguments:
        assert "load_tree" in prepare(path, tree_cache=cache, **options).timings
    same = {"intersection_cost": 0.25, "clip": True}
    assert "load_tree" in prepare(arguments[0][0], tree_cache=cache, **same).timings


def test_a_lazy_tree_is_not_kept_but_a_finished_one_is_used(
    scene: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    expected = render(scene).image
    lazy = prepare(scene, tree_cache=cache, builder="lazy")
    (message,) = lazy.warnings
    assert message.startswith(f"tree cache '{cache}' does not keep a tree")
    assert set(lazy.timings) == {"load", "find_tree", "build"}
    assert files(cache) == []
    prepare(scene, tree_cache=cache, builder="fast")
    again = prepare(scene, tree_cache=cache, builder="lazy")
    assert set(again.timings) == {"load", "load_tree"}
    assert again.warnings == ()
    for prepared in (lazy, again):
        assert prepared.render().image.tobytes() == expected.tobytes()


def test_light_and_camera_do_not_count(scene_file: SceneFile, tmp_path: Path) -> None:
    prepare(scene_file(), tree_cache=tmp_path / "cache")
    other = scene_file(emitters=scene_files.LAMP.replace("1, 2, 3", "1, 2, 4"))
    prepared = prepare(other, tree_cache=tmp_path / "cache", resolution=(20, 10))
    assert "load_tree" in prepared.timings


@pytest.mark.parametrize("damage", ["flipped", "cut off", "foreign", "empty", "folder"])
def test_a_file_that_is_no_use_is_replaced(
    damage: str, scene: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    first = render(scene, tree_cache=cache)
    (path,) = files(cache)
    good = path.read_bytes()
    path.unlink()
    if damage == "folder":
        path.mkdir()
        (path / "file").touch()
    else:
        flipped = bytearray(good)
        flipped[-10] ^= 4
        contents = {"flipped": flipped, "cut off": good[:-3], "empty": b""}
        path.write_bytes(contents.get(damage, b"a text"))
    with pytest.warns(MlrtWarning) as caught:
        again = render(scene, tree_cache=cache)
    messages = [str(warning.message) for warning in caught]
    assert messages[0].startswith(f"tree file '{path}' ")
    assert messages[0].endswith("; the tree is built again")
    assert again.warnings == tuple(messages)
    assert again.image.tobytes() == first.image.tobytes()
    if damage == "folder":
        assert messages[1].endswith("; the tree is not kept for another time")
        assert files(cache) == [path]
        return
    assert len(messages) == 1
    # Only the seconds of building differ.
    assert len(path.read_bytes()) == pytest.approx(len(good), abs=20)
    assert set(render(scene, tree_cache=cache).timings) == {"load", "load_tree", "render"}


def unwritable(tmp_path: Path) -> Iterator[Path]:
    blocked = tmp_path / "a file"
    blocked.touch()
    yield blocked
    yield blocked / "below"
    yield tmp_path / ("long" * 100)


def test_a_cache_that_cannot_be_made_does_no_harm(scene: Path, tmp_path: Path) -> None:
    expected = render(scene).image
    for cache in unwritable(tmp_path):
        with pytest.warns(MlrtWarning) as caught:
            image = render(scene, tree_cache=cache).image
        messages = [str(warning.message) for warning in caught]
        assert all(f"'{cache}" in message for message in messages)
        assert ("a file is in its place" in messages[-1]) == ("a file" in str(cache))
        assert messages[-1].endswith("; the tree is not kept for another time")
        assert image.tobytes() == expected.tobytes()


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_folder_that_may_not_be_written(scene: Path, tmp_path: Path) -> None:
    cache = tmp_path / "locked"
    cache.mkdir(mode=0o500)
    with pytest.warns(MlrtWarning, match="cannot be written: Permission denied"):
        render(scene, tree_cache=cache)
    assert files(cache) == []


def test_a_full_disk_leaves_nothing(scene: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    # Python ignores the signal, so that the write fails as on a full disk.
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, hard))
    try:
        prepared = prepare(scene, tree_cache=cache)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    (message,) = prepared.warnings
    assert "cannot be written: " in message
    assert files(cache) == []


@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_failures_late_in_writing_leave_nothing(
    call: str, scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cache = tmp_path / "cache"

    def fail(*arguments: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    monkeypatch.setattr(*((os, "fsync") if call == "fsync" else (Path, "replace")), fail)
    (message,) = prepare(scene, tree_cache=cache).warnings
    assert "cannot be written: Input/output error; the tree is not kept" in message
    assert files(cache) == []


RENDER_AGAIN_AND_AGAIN = """
import hashlib, sys
from pathlib import Path
from mlrt_plugin import prepare
scene, cache = map(Path, sys.argv[1:])
for i in range(20):
    prepared = prepare(scene, tree_cache=cache, intersection_cost=1.5 + i % 2)
    assert prepared.warnings == (), prepared.warnings
    print(hashlib.sha256(prepared.render(spp=1).image.tobytes()).hexdigest())
    if i % 3 == 0:  # so that all write again
        for path in cache.glob("*.kdtree"):
            path.unlink(missing_ok=True)
"""


def test_many_processes_share_a_cache(scene: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    command = [sys.executable, "-c", RENDER_AGAIN_AND_AGAIN, str(scene), str(cache)]
    with contextlib.ExitStack() as stack:
        workers = [
            stack.enter_context(
                subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=tmp_path)
            )
            for _ in range(3)
        ]
        printed = "".join(worker.communicate(timeout=120)[0] for worker in workers)
    assert [worker.returncode for worker in workers] == [0, 0, 0]
    expected = hashlib.sha256(render(scene, spp=1).image.tobytes()).hexdigest()
    assert printed.splitlines() == [expected] * 60
    assert all(path.suffix == ".kdtree" for path in files(cache))


def test_a_tree_that_is_there_already_is_not_looked_for(
    scene: Path, tmp_path: Path
) -> None:
    first = prepare(scene)
    prepare(scene, previous=first, tree_cache=tmp_path / "cache")
    assert not (tmp_path / "cache").exists()


def test_a_cache_without_a_name(scene: Path) -> None:
    with pytest.raises(TreeFileError, match=r"name of the folder .* is empty"):
        render(scene, tree_cache="")
