"""The command `mlrt render`: images, and what is left when it is interrupted."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
import scene_files

from mlrt_plugin import render
from mlrt_plugin.cli import main

SceneFile = Callable[..., Path]


def test_default_output_is_beside_the_scene(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file()
    assert main(["render", str(path)]) == 0
    output = path.with_suffix(".exr")
    np.testing.assert_array_equal(np.array(mi.Bitmap(str(output))), render(path).image)
    printed = capsys.readouterr()
    assert printed.out.startswith(f"{output}: 16x12, 2 spp; load ")
    assert printed.err == ""


def test_flags(scene_file: SceneFile, tmp_path: Path) -> None:
    other = scene_files.SENSOR.replace('id="eye"', "").replace('value="16"', 'value="$w"')
    path = scene_file(sensor=scene_files.SENSOR + other)
    output = tmp_path / "other.exr"
    flags = ["-o", str(output), "-D", "w=40", "-s", "1", "-t", "1", "--spp", "3"]
    assert main(["render", str(path), *flags, "--seed", "9", "--resolution", "20x10"]) == 0
    expected = render(
        path, defines={"w": 40}, sensor=1, spp=3, seed=9, resolution=(20, 10)
    ).image
    np.testing.assert_array_equal(np.array(mi.Bitmap(str(output))), expected)


def test_aovs(scene_file: SceneFile, tmp_path: Path) -> None:
    output = tmp_path / "image.exr"
    argv = ["render", str(scene_file()), "-o", str(output), "--aov", "prim,depth,normal"]
    assert main(argv) == 0
    with OpenEXR.File(str(output), separate_channels=True) as file:
        assert set(file.channels()) == {
            *"RGB",
            "depth.T",
            "prim.I",
            *(f"normal.{axis}" for axis in "XYZ"),
        }


def test_png(scene_file: SceneFile, tmp_path: Path) -> None:
    output = tmp_path / "image.png"
    assert main(["render", str(scene_file()), "-o", str(output)]) == 0
    assert np.array(mi.Bitmap(str(output))).shape == (12, 16, 3)


def test_verbose(scene_file: SceneFile, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", str(scene_file()), "-v"]) == 0
    assert "traversal_steps: " in capsys.readouterr().out


def test_warnings_are_told(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file(integrator='<integrator type="path"/>')
    assert main(["render", str(path), "--force-direct"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("mlrt: warning: integrator 'path'")


def test_interruption(scene_file: SceneFile) -> None:
    path = scene_file()
    command = Path(sys.executable).with_name("mlrt")
    flags = ["--resolution", "4096x4096", "--spp", "4096"]
    with subprocess.Popen(
        [command, "render", path, *flags],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # Jobs in the background of a shell are started with the signal ignored.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as process:
        time.sleep(4)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        try:
            output, errors = process.communicate(timeout=20)
        finally:
            process.kill()
    assert (process.returncode, output, errors) == (130, "", "mlrt: interrupted\n")
    assert list(path.parent.iterdir()) == [path]
