"""Speed against what goes wrong, of the figures of `mlrt-bench kernels`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from .table import plural

mpl.use("Agg")

MARKS = "os^Dv"
ERRORS = {
    "leaks": "leaks per million rays",
    "wrong_hits": "wrong hits per million rays,\nline to those that are far off",
    "ulps_p99": "error of t in ulps: 99th percentile,\nline to the greatest",
}
"""What is drawn upwards, by its name in the figures. Hits of other faces that tie with the
exact one are not among it: at vertices and edges each tracer may choose."""


def write_plot(path: Path, figures: dict[str, Any]) -> None:
    """A row of panels for each of ERRORS, a column for what rays are aimed at: the error
    over Mrays/s, a point for each contender and mesh. Of the first number of threads."""
    threads = figures["settings"]["threads"][0]
    blocks = [
        (scene["name"], block)
        for scene in figures["scenes"]
        for block in scene["blocks"]
        if block["threads"] == threads
    ]
    aims = list(dict.fromkeys(block["aim"] for _, block in blocks))
    meshes = list(dict.fromkeys(name for name, _ in blocks))
    names = list(dict.fromkeys(row["name"] for _, block in blocks for row in block["rows"]))
    colours = mpl.colormaps["tab20"]
    figure = Figure(figsize=(3.6 * len(aims) + 3.6, 9.6), layout="constrained")
    grid = figure.add_gridspec(len(ERRORS), len(aims) + 1)
    panels: list[list[Axes]] = []
    for i in range(len(ERRORS)):
        panels.append([])
        for j in range(len(aims)):
            shared = {"sharex": panels[0][0] if i + j else None}
            shared["sharey"] = panels[i][0] if j else None
            panels[i].append(figure.add_subplot(grid[i, j], **shared))
    draw_shadows(figure.add_subplot(grid[0, -1]), figures, threads, names, colours)
    for row_of_panels, (error, label) in zip(panels, ERRORS.items(), strict=True):
        for axes, aim in zip(row_of_panels, aims, strict=True):
            for mesh, block in blocks:
                if block["aim"] != aim:
                    continue
                for row in block["rows"]:
                    place = names.index(row["name"])
                    mark = MARKS[meshes.index(mesh) % len(MARKS)]
                    draw_row(axes, row, error, color=colours(place % 20), marker=mark)
            axes.set(xscale="log")
            axes.set_yscale("symlog", linthresh=1)
            axes.grid(True, alpha=0.25)
        row_of_panels[0].set_ylim(-0.4, max(2 * row_of_panels[0].get_ylim()[1], 10))
        row_of_panels[0].set_ylabel(label)
    for axes, aim in zip(panels[0], aims, strict=True):
        axes.set_title("rays anywhere" if aim == "anywhere" else f"rays at {aim}")
    for axes in panels[-1]:
        axes.set_xlabel(f"Mrays/s, {plural(threads)}")
    tests = [
        axes.scatter([], [], color=colours(place % 20), label=name)
        for place, name in enumerate(names)
    ]
    marks = [
        axes.scatter([], [], color="black", marker=mark, label=mesh)
        for mesh, mark in zip(meshes, MARKS, strict=False)
    ]
    free = figure.add_subplot(grid[1:, -1])
    free.set_axis_off()
    free.add_artist(free.legend(handles=tests, loc="upper left", title="colours"))
    free.legend(handles=marks, loc="lower left", title="marks")
    figure.savefig(path, dpi=100)


def draw_row(axes: Axes, row: dict[str, Any], error: str, **style: Any) -> None:
    rate = row["rays_per_second"] / 1e6
    if error == "ulps_p99":
        axes.scatter(rate, row["ulps_p99"], **style, s=28, alpha=0.85)
        axes.plot([rate, rate], [row["ulps_p99"], row["ulps_max"]], color=style["color"])
    else:
        share = 1e6 * row[error] / row["rays"]
        axes.scatter(rate, share, **style, s=28, alpha=0.85)
        if error == "wrong_hits":
            far = 1e6 * row["far_off"] / row["rays"]
            axes.plot([rate, rate], [far, share], color=style["color"])


def draw_shadows(
    axes: Axes, figures: dict[str, Any], threads: int, names: list[str], colours: Any
) -> None:
    """Pixels that are wrong over Mrays/s of shadow rays, of all sizes of the scene: full
    marks for robust offsets, empty ones for Mitsuba's."""
    blocks = [block for block in figures["shadows"] if block["threads"] == threads]
    for row in blocks[0]["rows"]:
        same = [
            other
            for block in blocks
            for other in block["rows"]
            if (other["name"], other["offset"]) == (row["name"], row["offset"])
        ]
        wrong = sum(other["acne"] + other["leaks"] for other in same)
        colour = colours(names.index(row["name"]) % 20)
        axes.scatter(
            row["rays_per_second"] / 1e6,
            wrong,
            edgecolors=[colour],
            facecolors=[colour] if row["offset"] == "robust" else "none",
        )
    axes.set_xscale("log")
    # On less than two decades every tick would have its number.
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yscale("symlog", linthresh=1)
    axes.set_ylim(-0.4, max(2 * axes.get_ylim()[1], 10))
    axes.grid(True, alpha=0.25)
    axes.set_xlabel(f"Mrays/s, {plural(threads)}")
    axes.set_title("shadow rays (full: robust offsets)")
    axes.set_ylabel("pixels with acne or leaks")
