"""The command `mlrt-bench kernels`."""

from __future__ import annotations

import argparse
from typing import Any

from mlrt_plugin.threads import thread_count

from .checkout import find_checkout
from .figures import new_figures, show, write_json
from .kernel_shadows import (
    PLACEMENTS,
    RESOLUTION,
    shadow_lines,
    study_shadows,
    time_frames,
)
from .kernels import AIMS, EXACT, closed_meshes, compare, kernel_contenders, rays_inside
from .kernels_summary import summary_lines
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .status import show_status
from .table import aligned

SEED = 20261128


def run(options: argparse.Namespace) -> bool:
    """Returns whether nothing leaks through exact tests."""
    source = find_checkout(options.source)
    native = load_native(source, options.cache or default_cache())
    settings = {
        "rays": options.rays,
        "repeats": options.repeats,
        "subdivisions": options.subdivisions,
        "threads": list(options.threads),
        "seed": SEED,
    }
    figures = new_figures("kernels", machine_record(source, native), settings)
    leaks = 0
    for mesh in closed_meshes(options.subdivisions):
        scene: dict[str, Any] = {"name": mesh.name, "skipped": None, "blocks": []}
        figures["scenes"].append(scene)
        for threads in options.threads:
            with thread_count(threads):
                contenders = kernel_contenders(native, mesh.vertices, mesh.faces, threads)
                for aim in AIMS:
                    show_status(f"{mesh.name}, {aim}, {threads} threads")
                    rays = rays_inside(mesh, aim, options.rays, SEED)
                    rows = compare(mesh, contenders, *rays, options.repeats)
                    leaks += sum(row["leaks"] for row in rows if row["name"] in EXACT)
                    show_status("")
                    scene["blocks"].append({"aim": aim, "threads": threads, "rows": rows})
                    title = f"{mesh.name}, {len(mesh.faces)} faces, rays at {aim}"
                    show(["", f"{title}, {threads} threads:", *lines(rows)])
        write_json(options.json, figures)
    figures["shadows"] = []
    for threads in options.threads:
        with thread_count(threads):
            for placement in PLACEMENTS:
                show_status(f"shadow rays, size {placement.name}, {threads} threads")
                rows = study_shadows(
                    native, placement, RESOLUTION, threads, options.repeats
                )
                show_status("")
                block = {"size": placement.size, "threads": threads, "rows": rows}
                figures["shadows"].append(block)
                title = f"shadow rays of the scene of `offsets`, size {placement.name}"
                show(["", f"{title}, {threads} threads:", *aligned(shadow_lines(rows))])
            frames = time_frames(RESOLUTION, options.repeats)
            figures.setdefault("frames", []).append({"threads": threads, **frames})
            show(["", frame_line(threads, frames)])
    write_json(options.json, figures)
    show(["", *summary_lines(figures)])
    if options.plot is not None:
        from .kernels_plot import write_plot

        write_plot(options.plot, figures)
    return leaks == 0


def lines(rows: list[dict[str, Any]]) -> list[str]:
    table: list[tuple[str, ...]] = [
        (
            *("test", "rays", "leaks", "other hits", "wrong of 10^9", "t inexact"),
            *("ulps p99", "max", "Mrays/s"),
        )
    ]
    for row in rows:
        table.append(
            (
                row["name"],
                f"{row['rays']:,}",
                f"{row['leaks']:,}",
                f"{row['other_hits']:,}",
                f"{row['wrong_per_billion']:,.0f}",
                f"{row['inexact_t']:,}",
                f"{row['ulps_p99']:.0f}",
                f"{row['ulps_max']:,}",
                f"{row['rays_per_second'] / 1e6:.2f}",
            )
        )
    return aligned(table)


def frame_line(threads: int, frames: dict[str, Any]) -> str:
    rates = {name: frames[name]["median"] / 1e6 for name in ("mitsuba", "robust")}
    return (
        f"whole frames, {threads} threads: {rates['mitsuba']:.2f} Mrays/s with Mitsuba's "
        f"offsets, {rates['robust']:.2f} with robust ones, which take "
        f"{rates['mitsuba'] / rates['robust']:.2f} times as long"
    )
