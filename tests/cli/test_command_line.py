"""The command `mlrt`: what it says and returns when it does not render."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import pytest
import repository
import scene_files

import mlrt_plugin
from mlrt_plugin import cli
from mlrt_plugin.cli import main

SceneFile = Callable[..., Path]


def failure(argv: list[str], code: int, capsys: pytest.CaptureFixture[str]) -> str:
    """Runs the command, which must fail with `code`, and returns its complaint."""
    try:
        returned = main(argv)
    except SystemExit as exit_:
        returned = exit_.code
    output = capsys.readouterr()
    assert returned == code
    assert output.out == ""
    (line,) = output.err.splitlines()
    assert line.startswith("mlrt: error: ")
    return line


USAGE = {
    "no command": ([], "required"),
    "unknown command": (["draw"], "draw"),
    "no scene": (["render"], "SCENE"),
    "unknown flag": (["render", "scene.xml", "--fast"], "--fast"),
    "definition": (
        ["render", "scene.xml", "-D", "res"],
        "'res' is not of the form key=value",
    ),
    "empty key": (["render", "scene.xml", "-D", "=3"], "'=3'"),
    "resolution": (["render", "scene.xml", "--resolution", "640"], "'640' is not a size"),
    "no pixels": (["render", "scene.xml", "--resolution", "0x4"], "'0x4' is not a size"),
    "negative size": (["render", "scene.xml", "--resolution=-4x4"], "'-4x4' is not a size"),
    "aov": (["render", "scene.xml", "--aov", "depth,albedo"], "'albedo' does not exist"),
    "spp": (["render", "scene.xml", "--spp", "many"], "many"),
    "sensor": (["info", "scene.xml", "-s", "left"], "left"),
    "empty name": (["render", ""], "SCENE: the name of the file is empty"),
    "one empty name": (["render", "scene.xml", ""], "the name of the file is empty"),
    "empty output": (["render", "scene.xml", "-o", ""], "the name of the file is empty"),
    "nothing to tell of": (["info", ""], "the name of the file is empty"),
}


@pytest.mark.parametrize("name", USAGE)
def test_usage_errors(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    argv, expected = USAGE[name]
    assert expected in failure(argv, 2, capsys)


ERRORS = {
    "no samples": (["--spp", "0"], "spp = 0"),
    "no threads": (["-t", "0"], "threads = 0"),
    "negative threads": (["--threads", "-2"], "threads = -2"),
    "a million threads": (["--threads", "1000000"], "threads = 1000000"),
    "seed": (["--seed", "-1"], "seed = -1"),
    "sensor": (["-s", "3"], "no sensor 3: it has 1"),
    "unused definition": (["-D", "res=3"], "$res=3"),
    "output folder": (["-o", "absent/image.exr"], "there is no folder absent: create it"),
    "output format": (["-o", "image.bmp"], "image.bmp"),
    "AOVs in a PNG": (["-o", "image.png", "--aov", "depth"], "cannot hold AOVs"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_errors_of_render(
    scene_file: SceneFile, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    flags, expected = ERRORS[name]
    path = scene_file()
    assert expected in failure(["render", str(path), *flags], 1, capsys)
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("command", ["render", "info"])
def test_missing_scene(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = failure([command, "absent.xml"], 1, capsys)
    assert line == "mlrt: error: scene file 'absent.xml' does not exist: check its path"


@pytest.mark.parametrize("folder", [".", ".."])
def test_a_folder_is_no_scene(
    folder: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    line = failure(["render", folder], 1, capsys)
    assert line == f"mlrt: error: scene '{folder}' is a folder: name the XML file in it"


def test_unsupported_feature(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file(shapes='<shape type="sdfgrid" id="ball"/>')
    line = failure(["render", str(path), "--shading", "native"], 1, capsys)
    assert "shape 'sdfgrid' with id 'ball'" in line
    assert str(path) in line


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_folder_that_cannot_be_written(
    scene_file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    argv = ["render", str(scene_file()), "-o", str(folder / "image.exr")]
    assert "no permission to write to the folder" in failure(argv, 1, capsys)


def test_traceback_on_request(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("MLRT_DEBUG", "1")
    with pytest.raises(mlrt_plugin.SceneError):
        main(["info", "absent.xml"])


def test_info_of_a_native_scene(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["info", str(scene_file())]) == 0
    text = capsys.readouterr().out
    assert "shape 'rectangle': native" in text
    assert "faces: 2, vertices: 4, vertex normals: not used" in text
    assert "film: 16x12, box filter, 2 spp" in text
    assert "not supported" not in text


def test_info_of_another_scene(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file(
        shapes='<shape type="sdfgrid" id="ball"><bsdf type="plastic" id="shiny"/></shape>',
        integrator='<integrator type="path"/>',
    )
    assert main(["info", str(path)]) == 0
    text = capsys.readouterr().out
    for expected in ("sdfgrid' with id 'ball", "plastic' with id 'shiny", "max_depth = -1"):
        assert expected in text


@pytest.mark.parametrize("name", ["cornell-box", "office"])
def test_info_of_the_scenes_of_the_project(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = repository.ROOT / "scenes" / name / f"{name}.xml"
    assert main(["info", str(path), "-D", "resx=32", "-D", "resy=24"]) == 0
    assert "film: 32x24" in capsys.readouterr().out


def test_log_level_is_restored(scene_file: SceneFile) -> None:
    before = mi.log_level()
    main(["info", str(scene_file()), "-v"])
    assert mi.log_level() == before


def test_installed_command() -> None:
    command = Path(sys.executable).with_name("mlrt")
    run = subprocess.run([command, "--version"], capture_output=True, text=True, timeout=60)
    assert (run.returncode, run.stdout) == (0, f"mlrt {mlrt_plugin.__version__}\n")
    run = subprocess.run(
        [command, "render", "absent.xml"], capture_output=True, text=True, timeout=60
    )
    assert (run.returncode, run.stdout) == (1, "")
    assert run.stderr == (
        "mlrt: error: scene file 'absent.xml' does not exist: check its path\n"
    )


def test_memory_that_does_not_suffice(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(*arguments: object) -> None:
        raise MemoryError

    monkeypatch.setitem(cli.COMMANDS, "info", fail)
    assert "not enough memory" in failure(["info", "any.xml"], 1, capsys)


@pytest.mark.parametrize("argv", [["tree"], ["tree", "--json"], ["info"]])
def test_a_reader_that_has_enough(argv: list[str], scene_file: SceneFile) -> None:
    command = Path(sys.executable).with_name("mlrt")
    reading, writing = os.pipe()
    os.close(reading)
    try:
        run = subprocess.run(
            [command, *argv, scene_file()],
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
        )
    finally:
        os.close(writing)
    assert (run.returncode, run.stderr) == (1, "")


def test_scene_text_is_a_scene(scene_file: SceneFile) -> None:
    """The helper's default scene must be sound, or tests of bad input show nothing."""
    assert len(mlrt_plugin.import_scene(scene_file()).faces) == 2
    assert len(mlrt_plugin.import_scene(scene_files.scene_dict()).faces) == 2
