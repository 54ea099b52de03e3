"""Speed against leaks, of the figures of `mlrt-bench kernels`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

mpl.use("Agg")

LEAST = 0.3
"""Where no leak stands on the logarithmic axis."""


def write_plot(path: Path, figures: dict[str, Any]) -> None:
    """A panel for what rays are aimed at: Mrays/s over rays per million that leak, a point
    for each contender and mesh. Of the first number of threads. Other hits are not shown:
    at vertices and edges faces tie, and each tracer may choose."""
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
    colours = mpl.colormaps["tab10"]
    figure = Figure(figsize=(4 * len(aims) + 4, 4.4), layout="constrained")
    *panels, last = figure.subplots(1, len(aims) + 1, squeeze=False)[0]
    for axes, aim in zip(panels, aims, strict=True):
        for mesh, block in blocks:
            if block["aim"] != aim:
                continue
            for row in block["rows"]:
                axes.scatter(
                    max(row["leaks"] / row["rays"] * 1e6, LEAST),
                    row["rays_per_second"] / 1e6,
                    color=colours(names.index(row["name"])),
                    marker="os^Dv"[meshes.index(mesh) % 5],
                    label=row["name"] if mesh == meshes[0] else None,
                )
        axes.set_xscale("log")
        axes.set_xlim(LEAST / 2, 1.5e6)
        axes.set_ylim(bottom=0)
        axes.set_title(f"rays at {aim}")
        axes.set_xlabel("leaks per million rays (left edge: none)")
    draw_shadows(last, figures, threads, names, colours)
    panels[0].set_ylabel(f"Mrays/s, {threads} thread{'s' if threads > 1 else ''}")
    panels[-1].legend(fontsize="small")
    marks = ", ".join(f"{'os^Dv'[i % 5]} {mesh}" for i, mesh in enumerate(meshes))
    figure.suptitle(f"What exact tests of triangles cost and give ({marks})", fontsize=10)
    figure.savefig(path, dpi=100)


def draw_shadows(
    axes: Any, figures: dict[str, Any], threads: int, names: list[str], colours: Any
) -> None:
    """Mrays/s of shadow rays over pixels that are wrong, of all sizes of the scene: full
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
        colour = colours(names.index(row["name"]))
        axes.scatter(
            max(wrong, LEAST),
            row["rays_per_second"] / 1e6,
            edgecolors=[colour],
            facecolors=[colour] if row["offset"] == "robust" else "none",
        )
    axes.set_xscale("log")
    axes.set_xlim(left=LEAST / 2)
    axes.set_ylim(bottom=0)
    axes.set_title("shadow rays (full: robust offsets)")
    axes.set_xlabel("pixels with acne or leaks (left edge: none)")
