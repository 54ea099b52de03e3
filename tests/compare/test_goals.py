"""compare/results/goals.md says what the figures say that it names."""

from __future__ import annotations

import json
from typing import Any

import pytest
import repository

RESULTS = repository.ROOT / "compare" / "results"
RAYS = {"1 spp": "rays-avx512-spp1.json", "16 spp": "rays-avx512-spp16.json"}


def rows() -> list[list[str]]:
    lines = (RESULTS / "goals.md").read_text().splitlines()
    head = lines.index("| | | best | median | goal | |")
    table = lines[head + 2 : lines.index("", head)]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table]


def speedup(scene: str, what: str) -> dict[str, float]:
    """Best and median of a row, on one thread."""
    name = "frames.json" if what.startswith("frame, ") else RAYS[" ".join(what.split()[:2])]
    spp = int(what.removeprefix("frame, ").split()[0])
    found: list[Any] = [
        block["speedup"]
        for each in json.loads((RESULTS / name).read_text())["scenes"]
        if each["name"] == scene
        for block in each["blocks"]
        if block["threads"] == 1 and block["spp"] == spp
        if name == "frames.json" or block["shadows"] == what.endswith("+ shadow")
    ]
    (one,) = found
    return dict(one)


@pytest.mark.parametrize("row", rows(), ids=lambda row: " ".join(row[:2]))
def test_a_row_is_what_was_measured(row: list[str]) -> None:
    scene, what, best, median, goal, state = row
    measured = speedup(scene, what)
    assert [best, median] == [f"{measured[key]:.2f}" for key in ("best", "median")]
    reached = [round(measured[key], 2) >= float(goal) for key in ("best", "median")]
    assert state == ("met" if all(reached) else "open" if any(reached) else "missed")


def test_no_goal_is_left_out() -> None:
    scenes = ("office", "conference", "building", "dragon-7.2M")
    wanted = {
        (scene, f"1 spp primary{shadow}")
        for scene in scenes
        for shadow in ("", " + shadow")
    }
    wanted |= {(scene, "16 spp primary") for scene in scenes}
    wanted |= {
        (scene, f"frame, {spp} spp")
        for scene in ("office", "conference")
        for spp in (1, 16)
    }
    assert {(row[0], row[1]) for row in rows()} == wanted
