"""The command `mlrt-bench watertight`."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from mlrt_plugin.threads import thread_count

from . import watertight
from .checkout import find_checkout
from .closed_meshes import ClosedMesh, chosen_meshes, usual_meshes
from .errors import BenchError
from .figures import measure_scenes, new_figures, show, write_json
from .hit_contenders import TRAVERSALS, hit_contenders
from .machine import machine_record
from .native import Native, load_native
from .options import default_cache
from .status import show_status
from .table import aligned
from .watertight import AIMS, Leaks

KEPT_SETTINGS = ("rays", "seed", "meshes")
"""What must be the same where a run is continued."""


def run(options: argparse.Namespace) -> bool:
    """Returns whether no ray escaped MLRT."""
    source = find_checkout(options.source)
    meshes = chosen_meshes(options.meshes, usual_meshes(source))
    native = load_native(source, options.cache or default_cache())
    settings = {"rays": options.rays, "seed": options.seed, "threads": options.threads}
    figures = new_figures("watertight", machine_record(source, native), settings)
    settings["meshes"] = [mesh.name for mesh in meshes]
    if options.resume:
        figures["scenes"] = meshes_to_keep(options.json, figures)
    kept = {scene["name"] for scene in figures["scenes"]}
    share = max(1, options.rays // (len(meshes) * len(AIMS)))

    def measure(mesh: ClosedMesh, scene: dict[str, Any]) -> None:
        with thread_count(options.threads):
            scene |= study(native, mesh, share, options.seed, options.threads)
        show(["", *lines(scene)])

    left = [mesh for mesh in meshes if mesh.name not in kept]
    if left:
        measure_scenes(figures, left, lambda mesh: mesh.load(), measure, options.json)
    figures["total"] = total(finished(figures))
    show(["", *total_lines(figures["total"])])
    write_json(options.json, figures)
    return not any(figures["total"]["leaks"][name] for name in TRAVERSALS)


def finished(figures: dict[str, Any]) -> list[dict[str, Any]]:
    """Meshes that were traced to the end."""
    return [scene for scene in figures["scenes"] if "rows" in scene]


def meshes_to_keep(path: Path | None, figures: dict[str, Any]) -> list[dict[str, Any]]:
    """Those that an ended run has finished, if there is its file.

    Raises BenchError if the file cannot be read, or if the run had another number of rays,
    seed, choice of meshes, or commit, as then its figures do not belong to those to come.
    """
    if path is None:
        raise BenchError("--continue needs --json, the file of the run that was ended")
    if not path.is_file():
        return []
    try:
        earlier = json.loads(path.read_text())
        belongs = earlier["benchmark"] == figures["benchmark"]
        for part, key in (*(("settings", k) for k in KEPT_SETTINGS), ("machine", "commit")):
            belongs &= earlier[part].get(key) == figures[part][key]
        if belongs:
            return finished(earlier)
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        raise BenchError(f"{path} does not hold figures of `watertight`") from error
    raise BenchError(
        f"{path} is of another benchmark, number of rays, seed, choice of meshes or "
        "commit: name another file"
    )


def study(
    native: Native, mesh: ClosedMesh, count: int, seed: int, threads: int
) -> dict[str, Any]:
    """Figures of a mesh: a row for each aim."""
    show_status(f"{mesh.name}: preparing")
    start = time.perf_counter()
    field = watertight.range_of(mesh, seed)
    mesh = field.mesh
    contenders = hit_contenders(native, mesh.vertices, mesh.faces, threads)
    rows = []
    for number, aim in enumerate(AIMS):
        show_status(f"{mesh.name}: {aim.name}")
        leaks = watertight.trace(field, contenders, aim, count, seed + number)
        rows.append({"aim": aim.name, "rays": count, "leaks": leaks_as_json(leaks)})
    show_status("")
    return {
        "triangles": len(mesh.faces),
        "rows": rows,
        "seconds": time.perf_counter() - start,
    }


def leaks_as_json(leaks: dict[str, Leaks]) -> dict[str, Any]:
    return {
        name: {"rays": found.rays, "count": found.count, "examples": found.examples}
        for name, found in leaks.items()
    }


def lines(scene: dict[str, Any]) -> list[str]:
    """Leaks of a mesh, as text."""
    names = list(scene["rows"][0]["leaks"])
    table = [("", "rays", *names)]
    for row in scene["rows"]:
        found = (row["leaks"][name] for name in names)
        leaks = (
            f"{each['count']:,}"
            + ("" if each["rays"] == row["rays"] else f" of {each['rays']:,}")
            for each in found
        )
        table.append((row["aim"], f"{row['rays']:,}", *leaks))
    head = f"{scene['name']}, {scene['triangles']:,} triangles, leaks:"
    return [head, *aligned(table)]


def total(scenes: list[dict[str, Any]]) -> dict[str, Any]:
    rows = [row for scene in scenes for row in scene["rows"]]
    names = list(rows[0]["leaks"])

    def sums(key: str) -> dict[str, int]:
        return {name: sum(row["leaks"][name][key] for row in rows) for name in names}

    return {
        "rays": sum(row["rays"] for row in rows),
        "traced": sums("rays"),
        "leaks": sums("count"),
    }


def total_lines(found: dict[str, Any]) -> list[str]:
    lines = []
    for name, count in found["leaks"].items():
        rays = found["traced"][name]
        lines.append(f"{name}: {count:,} of {rays:,} rays escape, {count / rays:.3g}")
    return lines
