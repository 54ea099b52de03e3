"""Several scenes and sensors in one call of `mlrt render`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files

from mlrt_plugin import render
from mlrt_plugin.cli import main

SceneFile = Callable[..., Path]

WIDE = scene_files.SENSOR.replace('id="eye"', "").replace('value="16"', 'value="24"')


def image(path: Path) -> np.ndarray:
    return np.array(mi.Bitmap(str(path)))


def test_names_are_derived(
    scene_file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = scene_file("one.xml")
    two = scene_file("two.xml", sensor=scene_files.SENSOR + WIDE)
    assert main(["render", str(one), str(two)]) == 0
    for path in (one, two):
        np.testing.assert_array_equal(image(path.with_suffix(".exr")), render(path).image)
    folder = tmp_path / "images"
    folder.mkdir()
    assert main(["render", str(two), "-s", "0,1", "-o", str(folder), "--seed", "3"]) == 0
    assert sorted(p.name for p in folder.iterdir()) == ["two-0.exr", "two-1.exr"]
    for sensor in (0, 1):
        np.testing.assert_array_equal(
            image(folder / f"two-{sensor}.exr"), render(two, sensor=sensor, seed=3).image
        )
    assert capsys.readouterr().err == ""


def test_all_sensors(scene_file: SceneFile, capsys: pytest.CaptureFixture[str]) -> None:
    """Of each scene as many as it has; one that cannot be read does not keep the others."""
    one = scene_file("one.xml")
    two = scene_file("two.xml", sensor=scene_files.SENSOR + WIDE)
    broken = scene_file("broken.xml", shapes="<shape")
    assert main(["render", str(one), str(broken), str(two), "-s", "all"]) == 1
    names = sorted(path.name for path in one.parent.glob("*.exr"))
    assert names == ["one.exr", "two-0.exr", "two-1.exr"]
    assert image(one.with_name("two-1.exr")).shape[1] == 24
    lines = capsys.readouterr().err.splitlines()
    assert lines[-1] == f"mlrt: error: 1 of 4 images failed: {broken}"
    assert len(lines) == 2


def test_the_others_are_rendered_if_one_fails(
    scene_file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first, last = scene_file("first.xml"), scene_file("last.xml")
    broken = scene_file("broken.xml", shapes="<shape")
    absent = tmp_path / "absent.xml"
    argv = ["render", *map(str, (first, broken, absent, last))]
    assert main(argv) == 1
    for path in (first, last):
        assert path.with_suffix(".exr").is_file()
    assert not broken.with_suffix(".exr").exists()
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 3
    assert "broken.xml" in lines[0] and "does not exist" in lines[1]
    assert lines[2] == f"mlrt: error: 2 of 4 images failed: {broken}, {absent}"


def test_sensor_that_is_not_there_is_named(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file()
    assert main(["render", str(path), "-s", "0,2"]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert "no sensor 2" in lines[0]
    assert lines[1].endswith(f"1 of 2 images failed: {path} (sensor 2)")


def test_images_may_not_overwrite_one_another(
    scene_file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file()
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / path.name
    other.write_text(path.read_text())
    argv = ["render", str(path), str(other), "-o", str(tmp_path)]
    assert main(argv) == 1
    assert "would both be written" in capsys.readouterr().err
    assert not list(tmp_path.glob("*.exr"))
    assert main(["render", str(path), str(other), "-o", str(tmp_path / "absent")]) == 1
    assert "folder that exists" in capsys.readouterr().err
    assert main(["render", str(path), str(other.parent / ".." / path.name)]) == 1
    assert "would both be written" in capsys.readouterr().err


def test_shading_is_told(scene_file: SceneFile, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", str(scene_file()), "-v"]) == 0
    assert "shading: native, because" in capsys.readouterr().out


def test_folders_to_look_in(
    scene_file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "meshes"
    folder.mkdir()
    (folder / "square.ply").write_bytes(scene_files.ply_bytes())
    path = scene_file(shapes=scene_files.mesh_shape("square.ply"))
    assert main(["render", str(path)]) == 1
    assert main(["render", str(path), "-a", f"{tmp_path};{folder}"]) == 0
    capsys.readouterr()
    with pytest.raises(SystemExit):
        main(["render", str(path), "-a", "absent"])
    assert "'absent' is no folder" in capsys.readouterr().err
