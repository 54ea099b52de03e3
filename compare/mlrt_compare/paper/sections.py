"""Sections of the study's page: rates, ablations, tiles and the control, as Markdown."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ..bench.markdown import table
from ..bench.table import number, plural
from .frame_times import SLOW_SECONDS
from .grouping import WAYS
from .published import PUBLISHED
from .ways import PAPER, TIMED, WITHOUT

Scenes = Sequence[dict[str, Any]]


def rate_lines(scenes: Scenes) -> list[str]:
    lines = [
        "Whole frames, from rays to the film: medians of those that others left alone; a "
        "star marks ways that had none, whose rates are not to be published. With one "
        "point light and shadow rays; the paper's shaded frames have a light at the camera "
        "and no shadow rays. Ways of which a frame takes more than "
        f"{SLOW_SECONDS:g} s, as counting the steps told, are not timed. Its processors: "
        "Pentium 4, 2.5 GHz with OpenRT, 2.4 GHz with one thread of MLRTA, 3.2 GHz with "
        "two threads on one core.",
    ]
    for scene in scenes:
        blocks = scene["rates"]
        heads = [
            plural(block["threads"]) + (", shadows" if block["shadows"] else "")
            for block in blocks
        ]
        rows = [
            [way.name, *(rate(block["ways"][way.key]) for block in blocks)] for way in TIMED
        ]
        lines += ["", *table([scene["name"], *heads], [*rows, *published_rates(scene)])]
    return lines


def rate(frame: dict[str, Any]) -> str:
    if frame["rate"] is None:
        return f"under {number(1 / frame['least_seconds'])}"
    return number(frame["rate"]) + ("" if frame["left_alone"] else "\\*")


def milliseconds(frame: dict[str, Any]) -> str:
    """Of the processor; what was not timed is told by its least."""
    if frame["cpu"] is None:
        return f"over {1e3 * frame['least_seconds']:,.0f}"
    return f"{1e3 * frame['cpu']:.1f}"


def published_rates(scene: dict[str, Any]) -> Iterator[list[str]]:
    """The paper's rows; where ours has shadow rays it has shaded frames."""
    published = PUBLISHED.get(scene["name"])
    if published is None or published.rates is None or published.shaded is None:
        return
    for name, threads, field in (
        ("paper: OpenRT", 1, "openrt"),
        ("paper: MLRTA", 1, "one_thread"),
        ("paper: MLRTA", 2, "two_threads"),
    ):
        cells = []
        for block in scene["rates"]:
            rates = published.shaded if block["shadows"] else published.rates
            cells.append(
                f"{getattr(rates, field):g}" if block["threads"] == threads else ""
            )
        if any(cells):
            yield [name, *cells]


def tree_lines(scenes: Scenes) -> list[str]:
    lines = [
        "Steps and tests of primary rays; frames of these with MLRTA on one thread, in the "
        "least CPU time. One tree was measured after another. The paper tells of "
        "about 50 % better traversal by its three rules, over a tree that it does not "
        "describe.",
    ]
    for scene in scenes:
        rows = [
            [
                row["name"],
                f"{row['tree']['inner_nodes'] + row['tree']['leaves']:,}",
                f"{row['tree']['references']:,}",
                f"{row[WITHOUT.key]['primary']['steps']:.2f}",
                f"{row[PAPER.key]['primary']['steps']:.2f}",
                f"{row[WITHOUT.key]['primary']['tests']:.2f}",
                milliseconds(row["frame"]),
            ]
            for row in scene["trees"]["rows"]
        ]
        head = ["nodes", "references", "steps without", "steps with", "tests", "frame ms"]
        lines += ["", *table([scene["name"], *head], rows)]
    return lines


def culling_lines(scenes: Scenes) -> list[str]:
    lines = [
        "Primary rays with MLRTA, as in the paper but for the test of its beams; frames "
        "without shadow rays on one thread, in the least CPU time.",
    ]
    for scene in scenes:
        rows = [
            [
                row["name"],
                f"{row['primary']['steps']:.2f}",
                f"{row['primary']['entry_steps']:.2f}",
                f"{row['tiles']:,}",
                f"{row['missed_tiles']:,}",
                milliseconds(row["frame"]),
            ]
            for row in scene["culling"]["rows"]
        ]
        head = ["steps", "of which search", "tiles", "of which missed", "frame ms"]
        lines += ["", *table([scene["name"], *head], rows)]
    return lines


def tile_lines(scenes: Scenes) -> list[str]:
    """Steps, and time over the least, for each ITS and split factor by MTS."""
    lines = [
        "The paper's traversal and search, `interval` with one entry point a tile: steps "
        "of primary rays (of which search), and CPU time of a frame of these on one thread "
        "over the least.",
    ]
    for scene in scenes:
        rows = scene["tiles"]
        least = min(row["frame"]["cpu"] for row in rows)
        minima = sorted({row["minimum_tile"] for row in rows})
        groups: dict[tuple[int, int], dict[int, str]] = {}
        for row in rows:
            steps = row["primary"]
            groups.setdefault((row["initial_tile"], row["split_factor"]), {})[
                row["minimum_tile"]
            ] = (
                f"{steps['steps']:.1f} ({steps['entry_steps']:.1f}), "
                f"{row['frame']['cpu'] / least:.2f}"
            )
        lines += [
            "",
            *table(
                [f"{scene['name']}: ITS, factor", *(f"MTS {value}" for value in minima)],
                [
                    [
                        f"{initial}, {factor}",
                        *(cells.get(minimum, "") for minimum in minima),
                    ]
                    for (initial, factor), cells in sorted(groups.items())
                ],
            ),
        ]
    return lines


def grouping_lines(scenes: Scenes) -> list[str]:
    lines = [
        "The same rays, through the centres of pixels, in other groups, and a shadow ray "
        "to each hit, for each 16 rays: all with their neighbours; rays of the same tile "
        "(MTS) in random order; rays from anywhere. Each ray has the same hit in all of "
        "them.",
    ]
    for scene in scenes:
        rows = []
        for name, grouping in scene["grouping"]["groupings"].items():
            for way in WAYS:
                counts = grouping["ways"][way.key]
                rows.append(
                    [
                        f"{name} ({grouping['rays']:,} rays): {way.name}",
                        *(
                            f"{counts[kind][what]:,.1f}"
                            for kind in ("primary", "shadow")
                            for what in ("steps", "entry_steps", "tests")
                        ),
                    ]
                )
        head = ["steps", "of which search", "tests"]
        heads = [*head, "steps of shadow rays", *head[1:]]
        lines += ["", *table([scene["name"], *heads], rows)]
    return lines
