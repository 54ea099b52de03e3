"""The figures of `mlrt-bench frames` as text."""

from __future__ import annotations

from typing import Any

from .speedup import MEDIANS, aims_text, best_frame, median_frame, ratio_lines, ratio_text
from .table import aligned, machine_lines, number, plural

COLUMNS = ("", "frame ms", "median", "CPU ms", "median", "frames")


def head_lines(machine: dict[str, Any], settings: dict[str, Any]) -> list[str]:
    side = settings["resolution"]
    return [
        *machine_lines(machine),
        f"frame: {side} x {side}, direct light, from the loaded and built scene to the "
        "finished film; best of the frames that others left alone, which are counted of "
        f"all frames; {MEDIANS}",
    ]


def scene_lines(scene: dict[str, Any]) -> list[str]:
    """What holds for all frames of a scene."""
    wide = scene["wide"]
    if wide is None:
        return []
    return [
        "",
        f"{scene['name']}: the form of the tree for rays that go alone took "
        f"{number(1e3 * wide['wall'])} ms ({number(1e3 * wide['cpu'])} ms of CPU time) "
        "beforehand, which no frame has",
    ]


def block_lines(scene: dict[str, Any], block: dict[str, Any]) -> list[str]:
    """The table of one scene, number of samples and of threads."""
    rows: list[tuple[str, ...]] = [COLUMNS]
    for contender in block["contenders"]:
        runs = contender["runs"]
        rows.append(
            (
                contender["name"],
                *(
                    number(1e3 * figure(contender, clock))
                    for clock in ("wall", "cpu")
                    for figure in (best_frame, median_frame)
                ),
                f"{sum(not run['busy'] for run in runs)}/{len(runs)}",
            )
        )
    speedup = block["speedup"]
    return [
        "",
        f"{scene['name']}, {plural(block['threads'])}, {block['spp']} spp, images: "
        f"{block['verdict']['text']}",
        *aligned(rows),
        f"  MLRT is {ratio_text(speedup)} times as fast{aims_text(speedup)}",
    ]


def goal_lines(scenes: list[dict[str, Any]]) -> list[str]:
    """All ratios: a row a scene and number of threads, a column a number of samples.

    Those of images that do not agree say so.
    """

    def column(block: dict[str, Any]) -> str:
        return f"{block['spp']} spp"

    lines = ratio_lines("MLRT / Mitsuba: best (median, CPU)", scenes, column)
    for scene in scenes:
        for block in scene.get("blocks", ()):
            if not block["verdict"]["passed"]:
                lines.append(
                    f"{scene['name']}, {plural(block['threads'])}, {column(block)}: the "
                    "images do NOT agree, so the ratio says nothing"
                )
    return lines
