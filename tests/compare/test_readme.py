"""mlrt-bench readme: README.md says what the kept figures say, and a change of one is
found."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository
from mlrt_compare.bench.checkout import LANDMARKS
from mlrt_compare.bench.cli import main
from mlrt_compare.error_plot import scene_name
from mlrt_compare.readme.page import BEGIN, END, RESULTS, page_of, spliced
from mlrt_compare.readme.pictures import Pair, Plot
from mlrt_compare.readme.tables import speed_error_lines
from PIL import Image as Pillow


def test_the_readme_is_in_step_with_the_figures() -> None:
    page = page_of(repository.ROOT)
    readme = (repository.ROOT / "README.md").read_text()
    assert spliced(readme, page.text) == readme, "draw it anew: mlrt-bench readme"
    assert page.pictures
    for picture in page.pictures:
        assert picture.is_current(), f"draw {picture.path} anew: mlrt-bench readme"


def test_pairs_are_the_two_images_of_their_comparison() -> None:
    pairs = [p for p in page_of(repository.ROOT).pictures if isinstance(p, Pair)]
    assert pairs
    for pair in pairs:
        whole, both = (np.asarray(Pillow.open(p)) for p in (pair.comparison, pair.path))
        width = pair.figures["width"]
        assert both.shape[1] == 2 * width
        np.testing.assert_array_equal(both, whole[:, : 2 * width])


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """One with a README and one file of figures."""
    for name in LANDMARKS:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "README.md").write_text(f"before\n{BEGIN}\n{END}\nafter\n")
    (tmp_path / RESULTS).mkdir(parents=True)
    source = repository.ROOT / RESULTS / "frames.json"
    shutil.copy(source, tmp_path / RESULTS / "frames.json")
    return tmp_path


def run(checkout: Path, *options: str) -> int:
    return main(["readme", "--source", str(checkout), *options])


def test_a_figure_that_changed_is_found_and_drawn(checkout: Path) -> None:
    readme = checkout / "README.md"
    before = readme.read_text()
    assert run(checkout, "--check") == 2
    assert readme.read_text() == before
    assert run(checkout) == 0
    assert readme.read_text().startswith("before\n") and "after\n" in readme.read_text()
    assert run(checkout, "--check") == 0
    file = checkout / RESULTS / "frames.json"
    figures = json.loads(file.read_text())
    speedup = figures["scenes"][0]["blocks"][0]["speedup"]
    speedup["best"], speedup["median"] = 0.4321, 7.654
    file.write_text(json.dumps(figures))
    assert run(checkout, "--check") == 2
    assert run(checkout) == 0
    assert "| **0.43** (7.65) |" in readme.read_text()


LIVING_ROOM = "living-room (direct)"


def side(name: str, mse: float) -> dict[str, Any]:
    points = [
        {
            "spp": spp,
            "median": 2.0 * spp,
            "seconds": [1.5 * spp, 2.0 * spp, 2.0 * spp, 3.0 * spp],
            "mse": mse / spp,
            "first": 5,
        }
        for spp in (1, 4)
    ]
    slope = {"value": -1.002, "low": -1.01, "high": -0.99}
    return {"name": name, "points": points, "slope": slope, "load": 0.25, "build": None}


def speed_error(**changes: Any) -> dict[str, Any]:
    machine = {"processor": "P", "isa": "avx2", "time": "2026-01-02T03", "commit": None}
    return {
        "scene": "../rooms/living-room/scene_direct.xml",
        "width": 64,
        "height": 48,
        "threads": 1,
        "machine": machine,
        "sides": [side("MLRT 1", 3e-3), side("Mitsuba 3", 3.1e-3)],
        "equal_time": {"value": 0.5, "low": 0.25, "high": 0.75},
        "equal_error": {"value": None, "low": None, "high": None},
        "passed": False,
        "reasons": ["a bias shows"],
        "disturbed": ["MLRT 1 at 4 spp"],
        "break_even_frames": None,
        **changes,
    }


def test_speed_and_error_are_told_with_what_speaks_against_them() -> None:
    lines = speed_error_lines([speed_error()])
    warm = next(line for line in lines if line.startswith(f"| {LIVING_ROOM} | 64 x"))
    slope = "-1.002 (-1.010 to -0.990)"
    assert warm == (
        f"| {LIVING_ROOM} | 64 x 48 | 1 to 4 | **0.50** (0.25 to 0.75) | - | {slope} "
        f"| {slope} | **FAIL** |"
    )
    cold = next(line for line in lines if line.startswith(f"| {LIVING_ROOM} | 0.250"))
    assert cold == f"| {LIVING_ROOM} | 0.250 | - | 5.00 | 0.250 | - | 5.00 | never |"
    assert f"- {LIVING_ROOM}: a bias shows" in lines
    assert (
        f"- {LIVING_ROOM}: times that are not to be published, of MLRT 1 at 4 spp" in lines
    )


def test_scenes_of_one_folder_have_names_of_their_own() -> None:
    names = [
        scene_name(f"rooms/living-room/{file}.xml") for file in ("scene", "scene_direct")
    ]
    assert names == ["living-room", "living-room (direct)"]
    assert scene_name("conference/conference_area.xml") == "conference_area"


def test_a_plot_is_stale_when_a_figure_in_it_changed(tmp_path: Path) -> None:
    figures = speed_error()
    plot = Plot(tmp_path / "plot.png", [figures, figures, figures])
    assert not plot.is_current()
    plot.path.write_bytes(plot.draw())
    assert plot.is_current()
    changed = speed_error(sides=[side("MLRT 1", 2.9e-3), side("Mitsuba 3", 3.1e-3)])
    assert not Plot(plot.path, [changed, figures, figures]).is_current()


def test_speed_and_error_and_pictures_come_into_the_readme(checkout: Path) -> None:
    folder = checkout / RESULTS / "speed-error"
    folder.mkdir()
    (folder / "box-speed-error.json").write_text(json.dumps(speed_error(scene="box.xml")))
    shutil.copytree(repository.ROOT / RESULTS / "pictures", checkout / RESULTS / "pictures")
    assert run(checkout) == 0
    assert run(checkout, "--check") == 0
    text = (checkout / "README.md").read_text()
    drawn = {path.name for path in (checkout / RESULTS / "readme").iterdir()}
    assert drawn == {"speed-error.png", "office.png", "living-room.png"}
    assert all(f"({RESULTS.as_posix()}/readme/{name})" in text for name in drawn)
    assert "CC BY 3.0" in text
    (checkout / RESULTS / "readme" / "office.png").unlink()
    assert run(checkout, "--check") == 2


def damaged(checkout: Path) -> None:
    (checkout / RESULTS / "rays.json").write_text("{")


def without_marks(checkout: Path) -> None:
    (checkout / "README.md").write_text("no marks")


def without_readme(checkout: Path) -> None:
    (checkout / "README.md").unlink()


def without_picture(checkout: Path) -> None:
    (checkout / RESULTS / "pictures").mkdir()
    (checkout / RESULTS / "pictures" / "office.json").write_text('{"scene": "none.xml"}')


def of_something_else(checkout: Path) -> None:
    (checkout / RESULTS / "rays.json").write_text('{"machine": {}}')


def is_a_list(checkout: Path) -> None:
    (checkout / RESULTS / "rays.json").write_text("[]")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (damaged, "rays.json holds no figures"),
        (is_a_list, "rays.json holds no figures"),
        (of_something_else, "other figures"),
        (without_marks, "README.md needs one line"),
        (without_readme, "README.md"),
        (without_picture, "none-comparison.png"),
    ],
)
def test_what_cannot_be_drawn_is_one_sentence(
    checkout: Path, capsys: pytest.CaptureFixture[str], spoil: Any, said: str
) -> None:
    spoil(checkout)
    assert run(checkout) == 4
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and said in lines[0]
    assert not [path for path in checkout.rglob("*") if "unfinished" in path.name]
