"""mlrt-bench frames as a command: figures, the verdict on the images, and one sentence for
what goes wrong."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import repository
from bench_command import assert_one_sentence, command

SMALL = ("--resolution", "48", "--repeats", "1")

# Runs the command with MLRT's image bent: a wrong renderer must be found out.
BENT = """
import sys
from mlrt_compare import llvm
llvm.activate()
from mlrt_compare.bench import cli
from mlrt_compare.mlrt_renderer import MlrtRenderer
right = MlrtRenderer.image.fget
MlrtRenderer.image = property(lambda renderer: 1.01 * right(renderer))
sys.exit(cli.main(sys.argv[1:]))
"""


@pytest.fixture(scope="module")
def measured(
    tmp_path_factory: pytest.TempPathFactory,
) -> tuple[str, dict[str, Any]]:
    """What is printed, and the figures, of a run on the office."""
    folder = tmp_path_factory.mktemp("measured")
    child = command(
        *("frames", "--scenes", "office,absent.xml", *SMALL, "--cache", folder / "cache"),
        *("--json", folder / "figures.json"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    return child.stdout, json.loads((folder / "figures.json").read_text())


def test_figures_are_whole(measured: tuple[str, dict[str, Any]]) -> None:
    _, figures = measured
    assert (figures["benchmark"], figures["version"]) == ("frames", 1)
    assert figures["machine"]["llvm"].startswith("LLVM ")
    office, absent = figures["scenes"]
    assert office["skipped"] is None and "absent.xml" in absent["skipped"]
    assert [(b["spp"], b["threads"]) for b in office["blocks"]] == [
        *((1, 1), (1, 2), (16, 1), (16, 2))
    ]
    assert office["wide"]["wall"] > 0
    goals = {1: (12.0, 15.0), 16: (10.0, 10.0)}
    for block in office["blocks"]:
        own, peer = block["contenders"]
        assert own["name"].startswith("MLRT") and peer["name"].startswith("Mitsuba")
        for contender in (own, peer):
            assert 1 <= len(contender["runs"]) <= 3
            assert all(run["frame"]["wall"] > 0 for run in contender["runs"])
        assert block["verdict"]["passed"] and block["verdict"]["text"] == "PASS"
        assert block["verdict"]["difference"]["share"] <= 1e-3
        speedup = block["speedup"]
        assert (speedup["goal"], speedup["stretch"]) == goals[block["spp"]]
        assert speedup["best"] > 0 and speedup["cpu"] > 0


def test_tables_are_there(measured: tuple[str, dict[str, Any]]) -> None:
    lines = measured[0].splitlines()
    for samples in (1, 16):
        title = f"office, 2 threads, {samples} spp, images: PASS"
        at = lines.index(title)
        assert lines[at + 2].startswith("MLRT") and lines[at + 3].startswith("Mitsuba")
    assert any(line.startswith("absent: skipped, there is no absent.xml") for line in lines)
    assert lines[-2].startswith("office, 1 thread ")
    assert lines[-1].startswith("office, 2 threads ")


def test_no_frame_makes_the_wide_form(measured: tuple[str, dict[str, Any]]) -> None:
    told = "office: the form of the tree for rays that go alone took"
    assert sum(line.startswith(told) for line in measured[0].splitlines()) == 1


def test_image_that_does_not_agree_is_told(tmp_path: Path) -> None:
    child = subprocess.run(
        [
            *(sys.executable, "-P", "-c", BENT, "frames", "--scenes", "office", *SMALL),
            *("--spp", "1", "--threads", "1", "--cache", str(tmp_path)),
        ],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=repository.ROOT,
    )
    assert child.returncode == 2, child.stdout + child.stderr
    assert "office, 1 thread, 1 spp, images: FAIL: " in child.stdout
    assert "office, 1 thread, 1 spp: the images do NOT agree" in child.stdout


def test_unusable_llvm_is_one_sentence(tmp_path: Path) -> None:
    broken = tmp_path / "libLLVM.so"
    broken.write_text("")
    child = command("frames", "--cache", tmp_path, DRJIT_LIBLLVM_PATH=str(broken))
    assert_one_sentence(child, "is not a libLLVM", "pip install")


def test_scene_that_cannot_be_rendered_is_skipped(tmp_path: Path) -> None:
    scene = tmp_path / "broken.xml"
    scene.write_text('<scene version="3.0.0"><shape type="cube"></scene>')
    child = command("frames", "--scenes", scene, *SMALL, "--cache", tmp_path)
    assert child.returncode == 4
    assert "broken: skipped" in child.stdout
    assert "none of the scenes is there" in child.stderr
