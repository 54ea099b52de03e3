"""The commands, of scenes that Mitsuba shades, with and without a libLLVM."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import plugin_scenes as parts
import pytest

from mlrt_plugin import render
from mlrt_plugin.cli import main

BODY = parts.block(parts.bsdf("roughplastic")) + parts.block("", 1, "sphere")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    path = tmp_path / "scene.xml"
    path.write_text(parts.scene(BODY))
    return path


def test_render_and_info(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", str(scene), "-v", "--seed", "2"]) == 0
    printed = capsys.readouterr()
    assert "shading: mitsuba, because bsdf 'roughplastic'" in printed.out
    assert "tree_shapes: 3" in printed.out and "mitsuba_shapes: 1" in printed.out
    image = np.array(mi.Bitmap(str(scene.with_suffix(".exr"))))
    np.testing.assert_allclose(image, render(scene, seed=2).image, rtol=1e-5, atol=1e-7)
    assert main(["info", str(scene)]) == 0
    text = capsys.readouterr().out
    for expected in (
        "shape 'sphere': by Mitsuba",
        "shape 'cube': hits native",
        "bsdf 'roughplastic': by Mitsuba",
        "shading: mitsuba, because",
    ):
        assert expected in text
    assert main(["info", str(scene), "--shading", "native"]) == 0
    assert "not supported:" in capsys.readouterr().out


def test_tree_of_the_meshes(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tree", str(scene), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["triangles"] == 2 + 2 + 12  # floor, panel, cube
    scene.write_text(parts.scene(parts.block("", 0, "sphere"), lights=parts.LAMP, floor=""))
    assert main(["tree", str(scene)]) == 1
    assert "has no triangle meshes" in capsys.readouterr().err


def test_cost_is_of_native_shading(scene: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", str(scene), "--aov", "cost"]) == 1
    assert "aov 'cost' does not exist where Mitsuba shades" in capsys.readouterr().err
    assert not scene.with_suffix(".exr").exists()


@pytest.mark.parametrize("shading", ["auto", "native"])
def test_without_llvm_only_native_scenes_are_rendered(scene: Path, shading: str) -> None:
    if shading == "native":
        scene.write_text(parts.SCENES["native"])
    program = "import sys; from mlrt_plugin.cli import main; sys.exit(main(sys.argv[1:]))"
    child = subprocess.run(
        [sys.executable, "-P", "-c", program, "render", str(scene)],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "DRJIT_LIBLLVM_PATH": str(scene.with_name("absent.so"))},
    )
    if shading == "native":
        assert child.returncode == 0, child.stderr
        return
    assert child.returncode == 1
    # Dr.Jit itself complains first.
    line = child.stderr.splitlines()[-1]
    assert line.startswith("mlrt: error: the scene needs Mitsuba's own shading, because")
    assert "'roughplastic'" in line and "absent.so is not a libLLVM" in line
    assert "pip install" in line
    assert not scene.with_suffix(".exr").exists()
