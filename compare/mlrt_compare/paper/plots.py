"""The study as plots, PNG images."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from ..bench.table import plural
from .grouping import WAYS
from .published import PUBLISHED
from .study import measured
from .text import published_counts
from .ways import PAPER, TIMED, WITHOUT

COLOURS = ("#3465a4", "#d95f02", "#4e9a06", "#75507b", "#c4a000", "#a40000", "#555753")
PALE = "#babdb6"
LINEAR_RANGE = 20
"""Bars that are as many times higher than those of other scenes are drawn logarithmic."""


def plots(figures: dict[str, Any]) -> Iterator[tuple[str, bytes]]:
    """Names without suffix, and images."""
    scenes = measured(figures)
    for name, draw in DRAWN.items():
        stream = io.BytesIO()
        draw(scenes).savefig(stream, format="png", dpi=130)
        yield name, stream.getvalue()


def draw_steps(scenes: Sequence[dict[str, Any]]) -> Figure:
    """Tables 1 and 2: ours in colour beside the paper's in grey, searches hatched."""
    figure = Figure(figsize=(max(2.4 + 2.2 * len(scenes), 6), 6.8), layout="constrained")
    kinds = (("primary", "primary rays"), ("primary_and_shadow", "and shadow rays"))
    for axes, (kind, title) in zip(figure.subplots(2), kinds, strict=True):
        for place, scene in enumerate(scenes):
            ways = scene["counts"]["ways"]
            published = published_counts(scene["name"], kind)
            own = (ways[WITHOUT.key][kind]["steps"], ways[PAPER.key][kind]["steps"])
            theirs = (published.steps_without, published.steps) if published else None
            bars = [(own, COLOURS[:2], ways[PAPER.key][kind]["entry_steps"])]
            if published is not None and theirs is not None:
                bars.append((theirs, (PALE, PALE), published.entry_steps or 0))
            for group, (values, colours, search) in enumerate(bars):
                for which, (value, colour) in enumerate(zip(values, colours, strict=True)):
                    x = place + 0.42 * group + 0.19 * which - 0.3
                    axes.bar(x, value, 0.18, color=colour, edgecolor="#555753", lw=0.5)
                    axes.annotate(
                        f"{value:.1f}", (x, value), ha="center", va="bottom", fontsize=7
                    )
                x = place + 0.42 * group + 0.19 - 0.3
                axes.bar(x, search, 0.18, fill=False, hatch="////", lw=0)
                ratio = values[0] / values[1]
                axes.annotate(
                    f"{ratio:.2f}x",
                    (place + 0.42 * group + 0.095 - 0.3, 0),
                    xycoords=axes.get_xaxis_transform(),
                    xytext=(0, -11),
                    textcoords="offset points",
                    ha="center",
                    va="top",
                    fontsize=8,
                    annotation_clip=False,
                )
        axes.set_xticks(range(len(scenes)), [f"\n{scene['name']}" for scene in scenes])
        axes.tick_params(axis="x", length=0)
        axes.set(ylabel="steps for 16 rays", title=title)
        highest = [highest_bar(scene, kind) for scene in scenes]
        if max(highest) > LINEAR_RANGE * min(highest):
            axes.set(yscale="log", ylim=(1, None))
        axes.spines[["top", "right"]].set_visible(False)
    figure.suptitle(
        "without MLRTA (blue) and with it (orange), of which search (hatched);\n"
        "grey: the paper; below each pair its ratio",
        fontsize=9,
    )
    return figure


def highest_bar(scene: dict[str, Any], kind: str) -> float:
    ways = scene["counts"]["ways"]
    return max(float(ways[way.key][kind]["steps"]) for way in (WITHOUT, PAPER))


def draw_rates(scenes: Sequence[dict[str, Any]]) -> Figure:
    """Table 3: frames a second by way, a panel for each scene, logarithmic."""
    figure = Figure(figsize=(9, 0.6 + 2.5 * len(scenes)), layout="constrained")
    for axes, scene in zip(panels(figure, len(scenes)), scenes, strict=True):
        blocks = scene["rates"]
        for number, way in enumerate(TIMED):
            frames = [block["ways"][way.key] for block in blocks]
            bars = axes.bar(
                np.arange(len(blocks)) + 0.11 * number - 0.33,
                [known(frame["rate"]) for frame in frames],
                0.1,
                color=COLOURS[number],
                label=way.name,
            )
            for bar, frame in zip(bars, frames, strict=True):
                bar.set_alpha(1 if frame.get("left_alone") else 0.35)
        published = PUBLISHED.get(scene["name"])
        for place, block in enumerate(blocks):
            if published is None or published.rates is None or published.shaded is None:
                continue
            theirs = published.shaded if block["shadows"] else published.rates
            values = {1: (theirs.openrt, theirs.one_thread), 2: (theirs.two_threads,)}
            for value in values.get(block["threads"], ()):
                axes.plot([place - 0.4, place + 0.4], [value, value], color="black", lw=1)
        axes.set_xticks(
            range(len(blocks)),
            [
                plural(block["threads"]) + (", shadows" if block["shadows"] else "")
                for block in blocks
            ],
        )
        axes.set(ylabel="frames/s", yscale="log", title=scene["name"])
        axes.yaxis.set_major_locator(LogLocator(10, subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=2,
        fontsize=8,
    )
    figure.suptitle(
        "black lines: the paper's, 1024 x 1024 pixels (OpenRT below MLRTA), of 2005;\n"
        "pale: others had a part of the machine, not to be published",
        fontsize=9,
    )
    return figure


def draw_trees(scenes: Sequence[dict[str, Any]]) -> Figure:
    return draw_ablation(
        scenes,
        "trees",
        {
            "references": lambda row: row["tree"]["references"],
            "steps without MLRTA": lambda row: row[WITHOUT.key]["primary"]["steps"],
            "steps with": lambda row: row[PAPER.key]["primary"]["steps"],
            "tests": lambda row: row[WITHOUT.key]["primary"]["tests"],
            "CPU time": lambda row: known(row["frame"]["cpu"]),
        },
    )


def draw_culling(scenes: Sequence[dict[str, Any]]) -> Figure:
    return draw_ablation(
        scenes,
        "culling",
        {
            "steps": lambda row: row["primary"]["steps"],
            "of which search": lambda row: row["primary"]["entry_steps"],
            "CPU time": lambda row: known(row["frame"]["cpu"]),
        },
    )


def draw_ablation(
    scenes: Sequence[dict[str, Any]],
    part: str,
    values: dict[str, Callable[[dict[str, Any]], float]],
) -> Figure:
    """Each row's figures over those of the first, which is as usual."""
    figure = Figure(figsize=(9, 0.6 + 2.7 * len(scenes)), layout="constrained")
    for axes, scene in zip(panels(figure, len(scenes)), scenes, strict=True):
        rows = scene[part]["rows"]
        width = 0.8 / len(values)
        for number, (name, value) in enumerate(values.items()):
            axes.bar(
                np.arange(len(rows)) + width * (number + 0.5) - 0.4,
                [value(row) / value(rows[0]) - 1 for row in rows],
                width,
                bottom=1,
                color=COLOURS[number],
                label=name,
            )
        axes.axhline(1, color="black", lw=0.7)
        axes.set_yscale("log", base=2)
        low, high = axes.get_ylim()
        steps = (1, 1.25, 1.5, 1.75) if high < 8 * low else (1,)
        axes.yaxis.set_major_locator(LogLocator(base=2, subs=steps))
        axes.yaxis.set_major_formatter("{x:g}")
        names = [row["name"].replace(" (", "\n(").replace(", ", ",\n") for row in rows]
        axes.set_xticks(range(len(rows)), names, fontsize=7)
        axes.set(ylabel=f"over '{rows[0]['name']}'", title=scene["name"])
        axes.spines[["top", "right"]].set_visible(False)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=len(values),
        fontsize=8,
    )
    return figure


def draw_tiles(scenes: Sequence[dict[str, Any]]) -> Figure:
    """Steps and time by MTS, a line for each ITS and split factor."""
    figure = Figure(figsize=(9, 0.8 + 2.6 * len(scenes)), layout="constrained")
    for number, scene in enumerate(scenes):
        rows = scene["tiles"]
        initials = sorted({row["initial_tile"] for row in rows})
        for side, (label, value) in enumerate(
            (
                ("steps for 16 primary rays", tile_steps),
                ("CPU ms a frame", tile_milliseconds),
            )
        ):
            axes = figure.add_subplot(len(scenes), 2, 2 * number + side + 1)
            for initial in initials:
                for factor, style in ((4, "-"), (16, "--")):
                    line = [
                        (row["minimum_tile"], value(row))
                        for row in rows
                        if (row["initial_tile"], row["split_factor"]) == (initial, factor)
                    ]
                    axes.plot(
                        *zip(*line, strict=True) if line else ((), ()),
                        style,
                        marker="o",
                        markersize=3,
                        color=COLOURS[initials.index(initial) % len(COLOURS)],
                        label=f"ITS {initial}, factor {factor}",
                    )
            if side == 0:
                without = scene["counts"]["ways"][WITHOUT.key]["primary"]["steps"]
                axes.axhline(without, color="black", lw=0.8, label="without MLRTA")
            minima = sorted({row["minimum_tile"] for row in rows})
            axes.set_xscale("log", base=2)
            axes.set_xticks(minima, [str(value) for value in minima])
            axes.set(xlabel="MTS", ylabel=label, title=scene["name"])
            axes.set_ylim(bottom=0)
            axes.spines[["top", "right"]].set_visible(False)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=4,
        fontsize=8,
    )
    return figure


def tile_steps(row: dict[str, Any]) -> float:
    return float(row["primary"]["steps"])


def tile_milliseconds(row: dict[str, Any]) -> float:
    return 1e3 * float(row["frame"]["cpu"])


def draw_grouping(scenes: Sequence[dict[str, Any]]) -> Figure:
    """Steps of the groupings by way, logarithmic, primary and shadow rays."""
    figure = Figure(figsize=(9, 0.8 + 2.6 * len(scenes)), layout="constrained")
    for number, scene in enumerate(scenes):
        groupings = scene["grouping"]["groupings"]
        for side, kind in enumerate(("primary", "shadow")):
            axes = figure.add_subplot(len(scenes), 2, 2 * number + side + 1)
            for which, way in enumerate(WAYS):
                axes.bar(
                    np.arange(len(groupings)) + 0.2 * which - 0.3,
                    [group["ways"][way.key][kind]["steps"] for group in groupings.values()],
                    0.19,
                    color=COLOURS[which],
                    label=way.name,
                )
            axes.set_xticks(
                range(len(groupings)), [name.replace(" w", "\nw") for name in groupings]
            )
            axes.set(yscale="log", ylabel="steps for 16 rays")
            axes.set_title(f"{scene['name']}, {kind} rays")
            axes.spines[["top", "right"]].set_visible(False)
    figure.legend(
        *figure.axes[0].get_legend_handles_labels(),
        loc="outside lower center",
        ncols=2,
        fontsize=8,
    )
    return figure


def known(value: float | None) -> float:
    """Nothing is drawn of what was not timed."""
    return np.nan if value is None else value


def panels(figure: Figure, count: int) -> list[Any]:
    """One below the other."""
    return [figure.add_subplot(count, 1, number + 1) for number in range(count)]


DRAWN: dict[str, Callable[[Sequence[dict[str, Any]]], Figure]] = {
    "paper-steps": draw_steps,
    "paper-rates": draw_rates,
    "paper-trees": draw_trees,
    "paper-culling": draw_culling,
    "paper-tiles": draw_tiles,
    "paper-grouping": draw_grouping,
}
