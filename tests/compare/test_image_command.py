"""mlrt-compare image: exit codes of idiff, files, and a sentence for bad input."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import exr_images
import numpy as np
import pytest
from mlrt_compare.cli import main
from mlrt_compare.options import write_text
from PIL import Image as Pillow
from pipes_read import reader_of

SEED = 20_260_808


@pytest.fixture
def reference(tmp_path: Path) -> Path:
    return exr_images.write_exr(tmp_path / "reference.exr", exr_images.picture(SEED))


def written(folder: Path, image: np.ndarray, **further: np.ndarray) -> Path:
    return exr_images.write_exr(folder / "image.exr", image, **further)


def run(*arguments: object) -> int:
    return main(["image", *map(str, arguments)])


def differing(pixels: int, by: float) -> np.ndarray:
    image = exr_images.picture(SEED)
    image.reshape(-1, 3)[:pixels, 1] += by
    return image


def test_as_a_program(tmp_path: Path, reference: Path) -> None:
    image = written(tmp_path, differing(3, 0.25))
    child = subprocess.run(
        [sys.executable, "-P", "-m", "mlrt_compare", "image", image, reference],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert child.returncode == 2 and not child.stderr, child.stderr
    assert "FAIL: 0.09766 % of the pixels differ" in child.stdout  # 3 of 3072


# 31 of 3072 pixels are 1.009 %.
@pytest.mark.parametrize(
    ("pixels", "by", "options", "code"),
    [
        (0, 0, (), 0),
        (1, 0.9e-6, (), 0),
        (1, 0.01, (), 2),
        (31, 0.01, ("--fail", "0.009", "--failpercent", "1.1", "--warn", 1), 0),
        (31, 0.01, ("--fail", "0.009", "--failpercent", "1.0"), 2),
        (31, 0.01, ("--fail", "0.011"), 1),
        (31, 0.01, ("--fail", "1", "--warn", "0.009", "--warnpercent", "1.1"), 0),
        (1, 0.01, ("--fail", "1", "--warn", "1", "--hardfail", "0.009"), 2),
        (1, 0.01, ("--fail", "1", "--warn", "1", "--hardwarn", "0.009"), 1),
        (1, 0.01, ("--fail-if", "rmse=1"), 0),
        (3072, 0.01, ("--fail-if", "rmse=0.0057"), 2),  # 0.01 / sqrt(3) = 0.00577
        (3072, 0.01, ("--fail-if", "rmse=0.0058"), 0),
        (3072, 0.01, ("--warn-if", "rmse=0.0057"), 1),
        (3072, 0.1, ("--fail-if", "ssim=0.9999"), 2),
        (0, 0, ("--fail-if", "ssim=0.9999", "--fail-if", "psnr=100"), 0),
        (3072, -0.01, ("--fail-if", "energy=0.001"), 2),
    ],
)
def test_exit_codes(
    tmp_path: Path,
    reference: Path,
    pixels: int,
    by: float,
    options: tuple[object, ...],
    code: int,
) -> None:
    assert run(written(tmp_path, differing(pixels, by)), reference, *options) == code


def test_json_and_maps(tmp_path: Path, reference: Path) -> None:
    image = written(tmp_path, differing(1, 0.5))
    figures, maps = tmp_path / "figures.json", tmp_path / "maps"
    assert run(image, reference, "--json", figures, "-o", maps) == 2
    told = json.loads(figures.read_text())
    assert (told["width"], told["height"], told["verdict"]) == (64, 48, "FAIL")
    assert [channel["name"] for channel in told["channels"]] == ["R", "G", "B"]
    assert told["metrics"]["abs"] == pytest.approx(0.5, rel=1e-6)
    assert told["metrics"]["rmse"] == pytest.approx((0.25 / 9216) ** 0.5, rel=1e-6)
    beyond = {entry["threshold"]: entry["share"] for entry in told["beyond"]}
    assert beyond[0.1] == 1 / 3072
    names = sorted(path.name for path in maps.iterdir())
    assert names == ["image-difference.png", "image-flip.png"]
    picture = np.asarray(Pillow.open(maps / "image-difference.png"))
    assert picture.shape == (48, 64, 3)
    assert picture[0, 0].min() > 150 and picture[1:].max() < 10


def test_nan_fails_and_is_shown(tmp_path: Path, reference: Path) -> None:
    broken = exr_images.picture(SEED)
    broken[5, 6, 0] = np.nan
    figures, maps = tmp_path / "figures.json", tmp_path / "maps"
    image = written(tmp_path, broken)
    options = ("--fail", 1, "--warn", 1, "--failpercent", 1, "--warnpercent", 1)
    assert run(image, reference, "--json", figures, "-o", maps, *options) == 2
    told = json.loads(figures.read_text())
    assert told["nonfinite_pixels"] == 1
    assert told["metrics"]["rmse"] is None and told["channels"][0]["nan"] == 1
    assert told["channels"][1]["rmse"] == 0
    picture = np.asarray(Pillow.open(maps / "image-difference.png"))
    assert picture[5, 6].tolist() == [255, 0, 255]


def test_channels_can_be_chosen(tmp_path: Path, reference: Path) -> None:
    image = written(tmp_path, exr_images.picture(SEED), depth=np.ones((48, 64)))
    assert run(image, reference) == 4
    assert run(image, reference, "--channels", "R,G,B") == 0


def test_variance_asks_for_a_z_test(tmp_path: Path, reference: Path) -> None:
    expected = exr_images.picture(SEED)
    variance = exr_images.write_exr(tmp_path / "variance.exr", 0.04 * expected**2)
    noise = np.random.default_rng(SEED).normal(0, 1, expected.shape)
    deviation = 0.2 * expected / 4  # of 16 samples
    figures = tmp_path / "figures.json"
    options = ("--variance", variance, "--spp", 16, "--json", figures)
    assert run(written(tmp_path, expected + noise * deviation), reference, *options) == 0
    assert json.loads(figures.read_text())["z_test"]["pixels_pass"]
    noisy = written(tmp_path, expected + 6 * noise * np.maximum(deviation, 0.0025))
    assert run(noisy, reference, *options) == 2
    assert not json.loads(figures.read_text())["z_test"]["pixels_pass"]


def test_folders_are_compared_by_name(tmp_path: Path) -> None:
    folders = [tmp_path / "ours", tmp_path / "theirs"]
    for folder in folders:
        folder.mkdir()
        for name in ("a.exr", "b.exr"):
            exr_images.write_exr(folder / name, exr_images.picture(SEED))
    figures = tmp_path / "figures.json"
    assert run(*folders, "--json", figures) == 0
    exr_images.write_exr(folders[0] / "b.exr", differing(1, 1))
    assert run(*folders, "--json", figures) == 2
    assert [told["verdict"] for told in json.loads(figures.read_text())] == ["PASS", "FAIL"]


def bad_inputs(folder: Path) -> dict[str, tuple[tuple[object, ...], str]]:
    right = exr_images.write_exr(folder / "right.exr", exr_images.picture(SEED))
    small = exr_images.write_exr(folder / "small.exr", exr_images.picture(SEED)[1:])
    further = exr_images.write_exr(
        folder / "further.exr", exr_images.picture(SEED), depth=np.ones((48, 64))
    )
    broken = exr_images.picture(SEED)
    broken[7, 9, 1] = np.nan
    nan = exr_images.write_exr(folder / "nan.exr", broken)
    broken[7, 9, 1] = -np.inf
    infinite = exr_images.write_exr(folder / "infinite.exr", broken)
    text = folder / "text.exr"
    text.write_text("not an image")
    cuts = []
    for length in (40, 200, 900, 30_000):  # in the header, and in each kind of data
        cuts.append(folder / f"cut-{length}.exr")
        cuts[-1].write_bytes(right.read_bytes()[:length])
    empty = folder / "empty"
    empty.mkdir()
    return {
        "sizes": ((small, right), "64 x 47 pixels and"),
        "missing channel": ((right, further), "lacks the channel depth"),
        "further channel": ((further, right), "lacks the channel depth"),
        "unknown channel": ((right, right, "--channels", "R,X"), "lacks the channel X"),
        "no EXR": ((text, right), "text.exr is not an EXR file"),
        **{path.stem: ((path, right), "may be damaged") for path in cuts},
        "no file": ((folder / "none.exr", right), "none.exr does not exist"),
        "nan in the reference": ((right, nan), "column 9, row 7"),
        "infinity in the reference": ((right, infinite), "nan or infinite"),
        "empty folder": ((empty, empty), "holds no EXR image"),
        "folder and file": ((empty, right), "is a folder and the other is not"),
        "no reference": ((right,), "REFERENCE"),
        "metric": ((right, right, "--fail-if", "beauty=1"), "beauty=1"),
        "threshold": ((right, right, "--fail", "nan"), "nan is not a number"),
        "percentage": ((right, right, "--failpercent", "-3"), "-3 is not from 0 to 100"),
        "no channel": ((right, right, "--channels", ","), "no channel is named"),
        "spp without variance": ((right, right, "--spp", "4"), "--variance"),
        "no folder": ((right, right, "-o", folder / "no" / "such"), "there is no folder"),
        "json": ((right, right, "--json", folder), "is a folder"),
        # A folder in which not even root can make files.
        "no json": ((right, right, "--json", "/proc/x.json"), "/proc/x.json cannot be"),
        "no maps": ((right, right, "-o", "/proc/x"), "/proc/x: No such file"),
    }


def test_bad_input_is_one_sentence(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for name, (arguments, said) in bad_inputs(tmp_path).items():
        assert run(*arguments) == 4, name
        captured = capfd.readouterr()
        lines = captured.err.splitlines()
        assert len(lines) == 1 and lines[0].startswith("mlrt-compare: "), (name, lines)
        assert said in lines[0], (name, lines)


def test_figures_go_into_a_pipe_that_stays_one(tmp_path: Path, reference: Path) -> None:
    file, pipe = tmp_path / "figures.json", tmp_path / "pipe.json"
    assert run(reference, reference, "--json", file) == 0
    with reader_of(pipe) as told:
        assert run(reference, reference, "--json", pipe) == 0
        assert told() == file.read_bytes()
    assert pipe.is_fifo()


def test_figures_and_maps_go_where_links_point(tmp_path: Path, reference: Path) -> None:
    kept, output = tmp_path / "kept", tmp_path / "output"
    kept.mkdir()
    output.mkdir()
    links = [output / "figures.json", output / "reference-difference.png"]
    for link in links:
        link.symlink_to(kept / link.name)
    assert run(reference, reference, "-o", output, "--json", links[0]) == 0
    assert all(link.is_symlink() for link in links)
    assert sorted(kept.iterdir()) == sorted(kept / link.name for link in links)
    assert json.loads(links[0].read_text())


def test_of_texts_that_grow_a_pipe_gets_the_last(tmp_path: Path) -> None:
    file, pipe = tmp_path / "file", tmp_path / "pipe"
    with reader_of(pipe) as told:
        for number in range(3):
            for path in (file, pipe):
                write_text(path, f"{number}", more_to_come=number < 2)
            assert file.read_text() == f"{number}"
        assert told() == b"2"


def test_a_folder_without_permission_is_told_of_before_the_work(
    tmp_path: Path,
    reference: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Root may write everywhere, so that the system's answer is made up."""
    locked = tmp_path / "locked"
    locked.mkdir()

    def access(path: Path, mode: int) -> bool:
        assert mode == os.W_OK | os.X_OK
        return path != locked

    monkeypatch.setattr(os, "access", access)
    monkeypatch.setattr("mlrt_compare.image_pair.compare_pair", None)
    for options in (("-o", locked), ("-o", locked / "new"), ("--json", locked / "x.json")):
        assert run(reference, reference, *options) == 4
        (line,) = capsys.readouterr().err.splitlines()
        assert f"no permission to write to the folder {locked}" in line
