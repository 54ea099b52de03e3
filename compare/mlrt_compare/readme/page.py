"""The results that README.md shows, from the figures in compare/results.

What was not measured is left out: each section needs its own files.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..bench.errors import BenchError
from .pictures import Pair, Plot
from .steps import ats_lines
from .tables import (
    frame_lines,
    kernel_lines,
    leak_lines,
    order_lines,
    paper_lines,
    ray_lines,
    speed_error_lines,
)

RESULTS = Path("compare/results")
BEGIN = "<!-- results: drawn by `mlrt-bench readme`, not by hand -->"
END = "<!-- end of results -->"
PAIRS = ("office", "living-room")
"""Scenes of which pictures may be shown, by the names of their files in `pictures`."""
CREDITS = {
    "living-room": '"The Grey & White Room" by Wig42, in the Mitsuba version of Benedikt '
    "Bitterli ([CC BY 3.0](https://creativecommons.org/licenses/by/3.0/)), here with "
    "diffuse surfaces and one point light",
}
INTRODUCTION = (
    "Ratios of times are above 1 where MLRT is faster; rows where it is slower somewhere "
    "have these ratios in **bold**. Ratios are of the best runs, in brackets of the "
    "medians. `mlrt-bench readme` draws all of this from the figures in "
    "[compare/results](compare/results), which name the machines, commits and settings.",
)


@dataclass(frozen=True)
class Page:
    """text: Markdown that stands between BEGIN and END. pictures: what it shows."""

    text: str
    pictures: tuple[Pair | Plot, ...]


def page_of(source: Path) -> Page:
    """Of the figures of a checkout. Raises BenchError if some cannot be read."""
    results = source / RESULTS
    lines = [*INTRODUCTION]
    pictures: list[Pair | Plot] = []
    for name in PAIRS:
        pair = pair_of(results, name)
        if pair is not None:
            pictures.append(pair)
            lines += ["", *pair_lines(pair, CREDITS.get(name))]
    measured = list(read_all(results / "speed-error", "*-speed-error.json"))
    if measured:
        told = section_of(speed_error_lines, measured, "speed-error/*-speed-error.json")
        plot = Plot(results / "readme" / "speed-error.png", measured)
        pictures.append(plot)
        lines += ["", *titled("Speed against error", told)]
        link = plot.path.relative_to(source).as_posix()
        lines += ["", f"![Error over time of both renderers]({link})"]
    for title, pattern, section in (
        ("Rays beside Embree", "rays*.json", ray_lines),
        ("Frames beside Mitsuba", "frames*.json", frame_lines),
        ("Orders of rays", "order*.json", order_lines),
        ("Tables of the paper", "paper*/paper.json", paper_lines),
        ("Steps from entry points", "ats*.json", ats_lines),
        ("Rays that have little in common", "kernels*.json", kernel_lines),
        ("Rays that leak", "watertight*.json", leak_lines),
    ):
        figures = list(read_all(results, pattern))
        if figures:
            lines += ["", *titled(title, section_of(section, figures, pattern))]
    return Page("\n".join(lines), tuple(pictures))


def section_of(
    section: Callable[[list[dict[str, Any]]], list[str]],
    figures: list[dict[str, Any]],
    pattern: str,
) -> list[str]:
    try:
        return section(figures)
    except (KeyError, TypeError, IndexError, StopIteration) as error:
        raise BenchError(
            f"{RESULTS / pattern} holds other figures than its command writes "
            f"({type(error).__name__}: {error}): measure them anew"
        ) from error


def titled(title: str, lines: list[str]) -> list[str]:
    return [f"### {title}", "", *lines]


def read_all(folder: Path, pattern: str) -> Iterator[dict[str, Any]]:
    """The figures of all files that match, in the order of their names."""
    for path in sorted(folder.glob(pattern)):
        yield {**read(path), "folder": path.parent.name}


def read(path: Path) -> dict[str, Any]:
    try:
        figures = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise BenchError(f"{path} holds no figures: {error}") from error
    if not isinstance(figures, dict):
        raise BenchError(f"{path} holds no figures: measure them anew")
    return figures


def pair_of(results: Path, name: str) -> Pair | None:
    """What `mlrt-compare` left of a scene in `pictures`; None if there is nothing."""
    path = results / "pictures" / f"{name}.json"
    if not path.is_file():
        return None
    figures = read(path)
    comparison = path.parent / f"{Path(figures['scene']).stem}-comparison.png"
    if not comparison.is_file():
        raise BenchError(f"there is no {comparison}, which {path.name} tells of")
    return Pair(results / "readme" / f"{name}.png", comparison, figures)


def pair_lines(pair: Pair, credit: str | None) -> list[str]:
    figures, difference = pair.figures, pair.figures["difference"]
    link = f"{RESULTS.as_posix()}/readme/{pair.path.name}"
    whole = f"{RESULTS.as_posix()}/pictures/{pair.comparison.name}"
    return [
        f"![{pair.path.stem}: MLRT to the left, Mitsuba to the right]({link})",
        "",
        f"{pair.path.stem}, {figures['width']} x {figures['height']} pixels, "
        f"{figures['spp']} samples each: MLRT to the left, Mitsuba to the right. "
        f"{difference['differing']:,} of {difference['pixels']:,} pixels "
        f"[differ]({whole}), and the root mean square of the differences is "
        f"{difference['rmse']:.2g}." + (f" Scene: {credit}." if credit else ""),
    ]


def spliced(text: str, section: str) -> str:
    """The text with the section between the marks. Raises BenchError without them."""
    pattern = re.compile(re.escape(BEGIN) + ".*?" + re.escape(END), re.DOTALL)
    if len(pattern.findall(text)) != 1:
        raise BenchError(f"README.md needs one line '{BEGIN}' and one '{END}' after it")
    return pattern.sub(lambda _: f"{BEGIN}\n\n{section}\n\n{END}", text)
