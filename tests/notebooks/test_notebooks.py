"""The notebooks run by the command of the README and leave what they promise."""

from __future__ import annotations

import base64
import io
import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import repository
from numpy.typing import NDArray
from PIL import Image as Pillow

FOLDER = repository.ROOT / "compare" / "notebooks"


class Outputs(NamedTuple):
    """What the cells of a notebook left."""

    figures: list[NDArray[np.uint8]]
    """(H, W, 3) each."""
    text: str
    tables: str
    """Markdown."""


@pytest.fixture(scope="module")
def executed(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Outputs]:
    pytest.importorskip("jupytext")
    pytest.importorskip("nbconvert")
    pytest.importorskip("ipykernel")
    folder = tmp_path_factory.mktemp("notebooks")
    return lambda name: outputs_of(execute(name, folder / f"{name}.ipynb"))


def execute(name: str, target: Path) -> dict[str, Any]:
    """Runs a notebook on its small settings; fails with its traceback if a cell raises."""
    child = subprocess.run(
        [
            *(sys.executable, "-P", "-m", "jupytext", "--to", "ipynb", "--execute"),
            *("--run-path", str(FOLDER), "--output", str(target)),
            str(FOLDER / f"{name}.py"),
        ],
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "MLRT_NOTEBOOKS": "small"},
    )
    assert child.returncode == 0, child.stdout + child.stderr
    notebook: dict[str, Any] = json.loads(target.read_text())
    return notebook


def outputs_of(notebook: dict[str, Any]) -> Outputs:
    figures, text, tables = [], "", ""
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):
            assert output["output_type"] != "error"
            # Of matplotlib, once on each machine.
            told = "".join(output.get("text", ()))
            assert output.get("name") != "stderr" or "font cache" in told, told
            text += told
            data = output.get("data", {})
            tables += "".join(data.get("text/markdown", ()))
            if "image/png" in data:
                stream = io.BytesIO(base64.b64decode(data["image/png"]))
                figures.append(np.asarray(Pillow.open(stream).convert("RGB")))
    return Outputs(figures, text, tables)


def shows_something(figure: NDArray[np.uint8]) -> bool:
    """Whether a figure is more than a frame and a title on white paper."""
    paper = np.all(figure > 250, axis=-1)
    return figure.shape[0] > 200 and figure.shape[1] > 400 and bool(paper.mean() < 0.95)


def rows_of(tables: str) -> list[list[str]]:
    """Cells of all rows of Markdown tables."""
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in tables.splitlines()
        if line.startswith("|") and not line.startswith("|---")
    ]


def test_every_notebook_is_tested() -> None:
    names = {path.stem for path in FOLDER.glob("*.py")}
    assert names == {
        "01_first_picture",
        "02_side_by_side",
        "03_timing",
        "04_speed_against_error",
        "05_kd_tree",
    }


def test_first_picture(executed: Callable[[str], Outputs]) -> None:
    left = executed("01_first_picture")
    picture, others = left.figures
    assert shows_something(picture) and shows_something(others)
    # The middle of the carpet, which is red and lit.
    red, green, blue = picture[int(0.75 * len(picture)), 200:280].mean(axis=0)
    assert red > 1.3 * green and red > 1.3 * blue
    assert "native" in left.text
    assert "the same image, bit for bit: True" in left.text


def test_side_by_side(executed: Callable[[str], Outputs]) -> None:
    left = executed("02_side_by_side")
    (figure,) = left.figures
    assert shows_something(figure)
    lines = left.text.splitlines()
    assert "PASS" in lines
    for spoiled in ("moved by a pixel", "darker by 1 %", "red and blue swapped"):
        (verdict,) = (line for line in lines if line.startswith(spoiled))
        assert "FAIL" in verdict


def test_timing(executed: Callable[[str], Outputs]) -> None:
    left = executed("03_timing")
    (figure,) = left.figures
    assert shows_something(figure)
    _, ours, theirs = rows_of(left.tables)
    assert ours[0].startswith("MLRT") and theirs[0].startswith("Mitsuba")
    for row in (ours, theirs):
        load, first, steady = (float(row[column]) for column in (1, 3, 4))
        assert min(load, first, steady) > 0
    assert "times as long" in left.tables
    # Wide spreads and this sentence come together; the table rounds.
    percents = [
        float(cell.removesuffix(" %")) for row in (ours, theirs) for cell in row[5:7]
    ]
    if abs(max(percents) - 10) > 0.1:
        assert ("spread by more than 10 %" in left.tables) == (max(percents) > 10)
    (busy,) = re.findall(r"^load\s+\[([\d.]+),", left.text, re.MULTILINE)
    assert ("at the start" in left.tables) == (float(busy) > 0.5)
    doubtful = "spread by more" in left.tables or "at the start" in left.tables
    assert ("not to be published" in left.tables) == doubtful
    assert "processor" in left.text


def test_speed_against_error(executed: Callable[[str], Outputs]) -> None:
    left = executed("04_speed_against_error")
    assert len(left.figures) == 3
    assert all(shows_something(figure) for figure in left.figures)
    assert "**PASS**" in left.tables
    points = [row for row in rows_of(left.tables) if row[0].isdigit()]
    assert [int(row[0]) for row in points] == [1, 2, 4, 8]
    for row in points:
        # Both take the same samples, so both have the same error.
        assert float(row[3]) == pytest.approx(float(row[4]), rel=0.01)
    errors = [float(row[3]) for row in points]
    assert errors == sorted(errors, reverse=True)
    assert 5 < errors[0] / errors[-1] < 12


def test_kd_tree(executed: Callable[[str], Outputs]) -> None:
    left = executed("05_kd_tree")
    assert len(left.figures) == 3
    assert all(shows_something(figure) for figure in left.figures)
    assert "the same image: True" in left.text
    table = {row[0]: [float(cell) for cell in row[1:]] for row in rows_of(left.tables)[1:]}
    from_root, from_entry_points, _ = table["packet steps"]
    search_of_root, search, _ = table["search steps"]
    assert search_of_root == 0 < search
    # What the paper is about: the searches cost less than they save.
    assert from_entry_points + search < 0.7 * from_root
    beam_steps = table["beam steps"]
    assert beam_steps[:2] == [0, 0] and beam_steps[2] > 0
