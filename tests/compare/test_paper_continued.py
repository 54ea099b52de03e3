"""mlrt-compare paper --continue and --again: what was measured is kept, if it belongs to
the rest."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import repository
from mlrt_compare.bench.machine import machine_record
from mlrt_compare.cli import main

QUICK = {
    "threads": [1, 2],
    "resolution": 128,
    "repeats": 2,
    "tiles": {"initial": [32, 128], "minimum": [8, 32]},
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With the figures of a quick run: office to the end, conference not."""
    kept = repository.ROOT / "compare/results/paper/paper.json"
    figures = json.loads(kept.read_text())
    by_name = {scene["name"]: scene for scene in figures["scenes"]}
    office = by_name["office"]
    unfinished = {key: value for key, value in office.items() if key != "trees"}
    figures["scenes"] = [office, {**unfinished, "name": "conference"}]
    figures["settings"] = QUICK
    figures["machine"] = machine_record(repository.ROOT, None)
    (tmp_path / "paper.json").write_text(json.dumps(figures))
    return tmp_path


def measured(folder: Path, *options: str) -> int:
    source = ("--source", str(repository.ROOT), "-o", str(folder))
    return main(["paper", "--quick", *options, *source])


def figures_of(folder: Path) -> dict[str, Any]:
    figures: dict[str, Any] = json.loads((folder / "paper.json").read_text())
    return figures


def test_what_is_there_is_kept_and_the_rest_is_added(folder: Path) -> None:
    office = figures_of(folder)["scenes"][0]
    missing = folder / "none.xml"
    assert measured(folder, "--continue", "--scenes", f"office,{missing}") == 0
    assert "| office |" in (folder / "paper.md").read_text()
    first, second = figures_of(folder)["scenes"]
    assert first == office
    assert second["name"] == "none" and "there is no" in second["skipped"]


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [("settings", "repeats", 9), ("machine", "commit", "0" * 40), ("machine", "isa", "x")],
)
def test_what_does_not_belong_together_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str], part: str, name: str, value: Any
) -> None:
    figures = figures_of(folder)
    figures[part][name] = value
    text = json.dumps(figures)
    (folder / "paper.json").write_text(text)
    assert measured(folder, "--continue", "--scenes", "office") == 4
    (line,) = capsys.readouterr().err.splitlines()
    assert f"another {name}" in line
    assert (folder / "paper.json").read_text() == text


def test_a_part_is_measured_again_and_the_others_are_kept(folder: Path) -> None:
    figures = figures_of(folder)
    figures["machine"]["commit"] = "0" * 40
    before = figures["scenes"][0]
    before["measured"] = {
        part: {"commit": "0" * 40, "seconds": 1.0, "cpu_seconds": 2.0}
        for part in ("counts", "grouping", "rates", "culling", "tiles", "trees")
    }
    # The other one has no end: it would be measured as a whole, were it asked for.
    (folder / "paper.json").write_text(json.dumps(figures))
    assert measured(folder, "--again", "culling", "--scenes", "office") == 0
    (after,) = figures_of(folder)["scenes"]
    assert after.keys() == before.keys()
    # Of the tree, which is built once more, the seconds differ.
    different = {key for key in before if key != "tree" and before[key] != after[key]}
    assert different == {"culling", "measured"}
    commit = machine_record(repository.ROOT, None)["commit"]
    assert after["measured"]["culling"]["commit"] == commit
    assert after["measured"]["rates"] == before["measured"]["rates"]
    assert len(after["culling"]["rows"][0]["frame"]["runs"]) <= 2 * 3
    page = (folder / "paper.md").read_text()
    assert "Of other commits than the rest: counts of office at 0000000000, " in page
    assert "culling of office at" not in page


def test_parts_of_other_settings_are_not_mixed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert measured(folder, "--again", "rates", "--resolution", "64") == 4
    assert "another resolution" in capsys.readouterr().err
    assert measured(folder, "--again", "rats") == 4
    assert "there is no part 'rats'" in capsys.readouterr().err
