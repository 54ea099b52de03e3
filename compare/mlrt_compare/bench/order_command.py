"""The command `mlrt-bench order`."""

from __future__ import annotations

import argparse
from typing import Any

from mlrt_plugin.threads import thread_count

from .checkout import find_checkout
from .contenders import EMBREE, MLRT
from .figures import measure_scenes, new_figures, show
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .order import SEED, measure_orders
from .scenes import BenchScene, chosen_scenes, scenes_of_rays
from .table import aligned, machine_lines, number, plural

COLUMNS = ("", "rays", "MLRT ns", "Embree ns", "Embree / MLRT", "hit differs", "best mode")


def run(options: argparse.Namespace) -> bool:
    source = find_checkout(options.source)
    names = options.scenes or ["office", "conference"]
    scenes = chosen_scenes(names, scenes_of_rays(source))
    cache = options.cache or default_cache()
    native = load_native(source, cache)
    settings = {
        "threads": list(options.threads),
        "repeats": options.repeats,
        "resolution": options.resolution,
        "seed": SEED,
    }
    figures = new_figures("order", machine_record(source, native), settings)
    show(machine_lines(figures["machine"]))

    def measure(loaded: BenchScene, scene: dict[str, Any]) -> None:
        scene["blocks"] = []
        for threads in options.threads:
            with thread_count(threads):
                rows = measure_orders(
                    native, loaded, options.resolution, threads, options.repeats
                )
            scene["blocks"].append({"threads": threads, "rows": rows})
            show(["", f"{scene['name']}, {plural(threads)}", *lines(rows)])

    measure_scenes(
        figures, scenes, lambda chosen: chosen.load(cache), measure, options.json
    )
    return True


def lines(rows: list[dict[str, Any]]) -> list[str]:
    table: list[tuple[str, ...]] = [COLUMNS]
    for row in rows:
        time = row["nanoseconds"]
        by_name = {each["name"]: each for each in row["contenders"]}
        table.append(
            (
                row["order"],
                f"{row['rays']:,}",
                number(time[MLRT]),
                number(time[EMBREE]),
                f"{time[EMBREE] / time[MLRT]:.2f}",
                str(by_name[time["mode"]]["differing"]),
                time["mode"].removeprefix(f"{EMBREE} "),
            )
        )
    return aligned(table)
