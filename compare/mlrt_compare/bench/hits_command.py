"""The command `mlrt-bench hits`."""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from mlrt_plugin.threads import thread_count

from .adversarial import RAYS, SCENES
from .checkout import find_checkout
from .figures import new_figures, show, write_json
from .hit_contenders import TRAVERSALS, hit_contenders
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .status import show_status
from .table import aligned
from .wrong_hits import study

COLUMNS = ("misses", "false_hits", "wrong_faces", "far_off", "wrong")


def run(options: argparse.Namespace) -> bool:
    """Returns whether MLRT has no wrong hit."""
    source = find_checkout(options.source)
    native = load_native(source, options.cache or default_cache())
    settings = {"rays": options.rays, "seed": options.seed, "threads": options.threads}
    figures = new_figures("hits", machine_record(source, native), settings)
    share = max(1, options.rays // (len(SCENES) * len(RAYS)))
    for number, make in enumerate(SCENES):
        scene = make(np.random.default_rng(options.seed + number))
        show_status(scene.name)
        start = time.perf_counter()
        with thread_count(options.threads):
            contenders = hit_contenders(
                native, scene.vertices, scene.faces, options.threads
            )
            rows = study(scene, contenders, share, options.seed)
        show_status("")
        figures["scenes"].append(
            {
                "name": scene.name,
                "triangles": len(scene.faces),
                "rows": rows,
                "seconds": time.perf_counter() - start,
            }
        )
        show(["", f"{scene.name}, {len(scene.faces)} triangles:", *lines(rows)])
        write_json(options.json, figures)
    figures["total"] = total([row for scene in figures["scenes"] for row in scene["rows"]])
    show(["", "all:", *lines([figures["total"]])])
    write_json(options.json, figures)
    return not any(figures["total"]["errors"][name]["wrong"] for name in TRAVERSALS)


def total(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Sums over rows; of the error of t, the greatest."""
    names = rows[0]["errors"]
    errors: dict[str, dict[str, int]] = {}
    for name in names:
        errors[name] = {
            key: (max if key == "greatest_ulps" else sum)(
                row["errors"][name][key] for row in rows
            )
            for key in rows[0]["errors"][name]
        }
    sums = {key: sum(row[key] for row in rows) for key in ("rays", "at_origin")}
    return {"rays_of": "all", **sums, "errors": errors}


def lines(rows: list[dict[str, Any]]) -> list[str]:
    """Wrong hits by kind of rays and contender, and errors of t of the others."""
    head = [name.replace("_", " ") for name in COLUMNS]
    table = [("", "rays", *head, "t inexact", "greatest ulps")]
    for row in rows:
        for name, errors in row["errors"].items():
            counted = row["rays"] - row["at_origin"]
            table.append(
                (
                    f"{row['rays_of'].replace('_', ' ')}, {name}",
                    f"{counted:,}",
                    *(f"{errors[column]:,}" for column in COLUMNS),
                    f"{errors['inexact']:,}",
                    f"{errors['greatest_ulps']:,}",
                )
            )
    return aligned(table)
