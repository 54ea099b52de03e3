"""The command `mlrt-bench kernels`."""

from __future__ import annotations

import argparse
from typing import Any

from mlrt_plugin.threads import thread_count

from .checkout import find_checkout
from .figures import new_figures, show, write_json, write_text
from .kernel_shadows import (
    PLACEMENTS,
    RESOLUTION,
    shadow_lines,
    study_shadows,
    time_frames,
)
from .kernels import (
    AIMS,
    COHERENT,
    EXACT,
    closed_meshes,
    compare,
    kernel_contenders,
    rays_inside,
)
from .kernels_summary import summary_lines
from .machine import machine_record
from .markdown import table
from .native import load_native
from .options import default_cache
from .status import show_status
from .table import aligned, machine_lines, plural

SEED = 20261128


def run(options: argparse.Namespace) -> bool:
    """Returns whether exact tests find what is there."""
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
    wrong = 0
    for mesh in closed_meshes(options.subdivisions):
        scene: dict[str, Any] = {"name": mesh.name, "skipped": None, "blocks": []}
        figures["scenes"].append(scene)
        for threads in options.threads:
            with thread_count(threads):
                contenders = kernel_contenders(native, mesh.vertices, mesh.faces, threads)
                for aim in AIMS:
                    show_status(f"{mesh.name}, {aim}, {threads} threads")
                    rays = rays_inside(mesh, aim, options.rays, SEED)
                    chosen = [
                        contender
                        for contender in contenders
                        if aim == "pixels" or contender.name not in COHERENT
                    ]
                    rows = compare(mesh, chosen, *rays, options.repeats)
                    wrong += sum(
                        row["leaks"] + row["wrong_hits"]
                        for row in rows
                        if row["name"] in EXACT
                    )
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
    write_text(options.markdown, markdown(figures))
    if options.plot is not None:
        from .kernels_plot import write_plot

        write_plot(options.plot, figures)
    return wrong == 0


HEAD = (
    *("test", "rays", "leaks", "other hits", "wrong hits", "far off", "wrong of 10^9"),
    *("t inexact", "ulps p99", "max", "Mrays/s"),
)


def lines(rows: list[dict[str, Any]]) -> list[str]:
    return aligned([HEAD, *map(cells, rows)])


def cells(row: dict[str, Any]) -> tuple[str, ...]:
    return (
        row["name"],
        f"{row['rays']:,}",
        f"{row['leaks']:,}",
        f"{row['other_hits']:,}",
        f"{row['wrong_hits']:,}",
        f"{row['far_off']:,}",
        f"{row['wrong_per_billion']:,.0f}",
        f"{row['inexact_t']:,}",
        f"{row['ulps_p99']:.0f}",
        f"{row['ulps_max']:,}",
        f"{row['rays_per_second'] / 1e6:.2f}",
    )


def markdown(figures: dict[str, Any]) -> str:
    """All rows as a page."""
    page = [
        "# Tests of triangles and ways through the tree",
        "",
        "By `mlrt-bench kernels`: leaks are rays that find nothing; other hits those of "
        "another face than the exact one, most of which tie; wrong hits such of a face "
        "that exact arithmetic does not have among the nearest; far off those of them that "
        "are wrong by more than 2^-20 of the distance, which are no neighbours; wrong of "
        "10^9 are leaks and wrong hits; then distances that are not the nearest float, and "
        "by how many units in the last place.",
        "",
        *summary_lines(figures),
        "",
        *machine_lines(figures["machine"]),
    ]
    for scene in figures["scenes"]:
        for block in scene["blocks"]:
            title = f"{scene['name']}, rays at {block['aim']}, {plural(block['threads'])}"
            page += ["", f"## {title}", "", *table(HEAD, map(cells, block["rows"]))]
    return "\n".join(page) + "\n"


def frame_line(threads: int, frames: dict[str, Any]) -> str:
    rates = {name: frames[name]["median"] / 1e6 for name in ("mitsuba", "robust")}
    return (
        f"whole frames, {threads} threads: {rates['mitsuba']:.2f} Mrays/s with Mitsuba's "
        f"offsets, {rates['robust']:.2f} with robust ones, which take "
        f"{rates['mitsuba'] / rates['robust']:.2f} times as long"
    )
