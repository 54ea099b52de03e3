"""mlrt-compare as a command: exit codes, files, and one sentence for everything that goes
wrong."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest
from compare_command import BENT, python

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "cornell-box" / "cornell-box.xml"
SMALL = ("--resolution", "32x24", "--spp", "2", "--rounds", "1")


def command(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    return python("-m", "mlrt_compare", *arguments, **environment)


def assert_one_sentence(child: subprocess.CompletedProcess[str], *said: str) -> None:
    assert child.returncode == 4, child.stderr
    lines = child.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("mlrt-compare: "), child.stderr
    for words in said:
        assert words in lines[0]


def test_agreeing_images_pass_and_leave_their_files(tmp_path: Path) -> None:
    output, figures = tmp_path / "output", tmp_path / "figures.json"
    child = command(SCENE, *SMALL, "--seed", 3, "-o", output, "--json", figures)
    assert child.returncode == 0, child.stdout + child.stderr
    assert "PASS" in child.stdout
    assert sorted(path.name for path in output.iterdir()) == [
        "cornell-box-comparison.png",
        "cornell-box-mitsuba.exr",
        "cornell-box-mlrt.exr",
    ]
    told = json.loads(figures.read_text())
    assert told["passed"] and told["difference"]["pixels"] == 32 * 24
    assert (told["spp"], told["seed"]) == (2, 3)
    mlrt, mitsuba = told["timings"]
    for side in (mlrt, mitsuba):
        assert len(side["frames"]) == 2
        assert all(side[key] >= 0 for key in ("load", "build", "first", "steady"))
    assert mlrt["jit"] is None and mitsuba["jit"] is not None


def test_report_is_a_page_with_the_plot_of_the_folder(tmp_path: Path) -> None:
    point = {"spp": 1, "median": 2, "minimum": 1, "mse": 3, "seconds": [1, 2, 3]}
    figures = {
        "sides": [{"name": name, "points": [point]} for name in ("MLRT", "Mitsuba")],
        **{key: {"value": 2, "low": 1, "high": 3} for key in ("equal_time", "equal_error")},
        "machine": {"time": "then"},
        "scene": "box",
        "samples": [1],
        "equal_time_spp": [1],
        "equal_error_spp": [1],
        "width": 32,
        "height": 24,
        "threads": 2,
        "passed": True,
        "reasons": [],
        "disturbed": [],
    }
    (tmp_path / "cornell-box-speed-error.json").write_text(json.dumps(figures))
    child = command(SCENE, *SMALL, "-o", tmp_path, "--report")
    assert child.returncode == 0, child.stdout + child.stderr
    page = (tmp_path / "cornell-box-report.html").read_text()
    assert "cornell-box.xml: MLRT and Mitsuba" in page
    assert "at equal time 2.00 (1.00 to 3.00) times less MSE" in page


def test_written_images_are_what_was_compared(tmp_path: Path) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    figures = tmp_path / "figures.json"
    child = command(SCENE, *SMALL, "-o", tmp_path, "--json", figures)
    assert child.returncode == 0, child.stdout + child.stderr
    images = [
        np.array(mi.Bitmap(str(tmp_path / f"cornell-box-{side}.exr")), np.float64)
        for side in ("mlrt", "mitsuba")
    ]
    rmse = np.sqrt(np.mean((images[0] - images[1]) ** 2))
    assert rmse == pytest.approx(
        json.loads(figures.read_text())["difference"]["rmse"], rel=1e-6
    )


@pytest.mark.parametrize(
    "how",
    [
        "image * 1.01",
        "image[:, ::-1]",
        "image[..., ::-1]",
        "image * 0",
        "image * float('nan')",
        "image[1:]",
    ],
)
def test_wrong_image_fails(tmp_path: Path, how: str) -> None:
    child = python("-c", BENT.format(how=how), SCENE, *SMALL, "-o", tmp_path)
    assert child.returncode == 2, child.stdout + child.stderr
    assert "FAIL: " in child.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "SCENE"),
        (("missing.xml",), "missing.xml"),
        ((SCENE, "--spp", "0"), "--spp: 0 is less than 1"),
        ((SCENE, "--spp", "many"), "'many' is not a whole number"),
        ((SCENE, "--resolution", "64"), "WIDTHxHEIGHT"),
        ((SCENE, "--resolution", "0x64"), "WIDTHxHEIGHT"),
        ((SCENE, "-D", "spp"), "KEY=VALUE"),
        ((SCENE, "-D", "no_such_parameter=1"), "no_such_parameter"),
        ((SCENE, "-s", "1"), "sensor"),
        ((SCENE, "-o", SCENE), "not a folder"),
        ((SCENE, "-o", SCENE.parent / "no" / "such"), "no folder"),
        ((SCENE, "--json", SCENE.parent / "no" / "such.json"), "no folder"),
        ((SCENE, "--json", SCENE.parent), "is a folder"),
        ((SCENE, "--report", "--speed-error", SCENE), "holds no figures"),
        ((SCENE, "--report", "--speed-error", "none.json"), "none.json"),
        ((SCENE, "--speed-error", "none.json"), "--report"),
    ],
)
def test_what_cannot_run_is_one_sentence(
    tmp_path: Path, arguments: tuple[object, ...], said: str
) -> None:
    output = () if "-o" in arguments else ("-o", tmp_path / "output")
    assert_one_sentence(command(*arguments, *output), said)
    assert not list(tmp_path.iterdir())


def test_malformed_scene_is_one_sentence(tmp_path: Path) -> None:
    scene = tmp_path / "broken.xml"
    scene.write_text('<scene version="3.0.0"><shape type="cube"></scene>')
    assert_one_sentence(command(scene, "-o", tmp_path / "output"), "broken.xml")
    assert not (tmp_path / "output").exists()


def test_unusable_llvm_is_one_sentence(tmp_path: Path) -> None:
    library = tmp_path / "libLLVM-15.so.1"
    library.write_text("not a library")
    child = command(
        SCENE, *SMALL, "-o", tmp_path / "output", DRJIT_LIBLLVM_PATH=str(library)
    )
    assert_one_sentence(child, "libLLVM-15.so.1", "pip install 'mlrt[compare]'")
    assert not (tmp_path / "output").exists()


@pytest.mark.parametrize("package", ["PIL", "mitsuba"])
def test_missing_package_is_one_sentence(tmp_path: Path, package: str) -> None:
    """As after an installation without the extra `compare`."""
    code = f"""
import sys
sys.modules["{package}"] = None
from mlrt_compare.cli import main
sys.exit(main(sys.argv[1:]))
"""
    child = python("-c", code, SCENE, *SMALL, "-o", tmp_path / "output")
    assert_one_sentence(child, package, "pip install 'mlrt[compare]'")
    assert not (tmp_path / "output").exists()


def test_errors_that_nobody_expects_are_one_sentence(tmp_path: Path) -> None:
    child = python("-c", BENT.format(how="1 / 0"), SCENE, *SMALL, "-o", tmp_path)
    assert_one_sentence(child, "ZeroDivisionError: division by zero")
    assert not list(tmp_path.iterdir())


def test_help_tells_the_exit_codes() -> None:
    child = command("--help")
    assert child.returncode == 0
    assert "Exit codes" in child.stdout
