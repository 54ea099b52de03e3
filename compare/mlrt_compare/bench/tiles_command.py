"""The command `mlrt-bench tiles`."""

from __future__ import annotations

import argparse
from typing import Any

from .checkout import find_checkout
from .figures import measure_scenes, new_figures, show
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .scenes import BenchScene, chosen_scenes, usual_scenes
from .tiles import INITIAL_TILES, MINIMUM_TILES, SPLIT_FACTORS, TRAVERSALS, measure_tiles


def run(options: argparse.Namespace) -> bool:
    source = find_checkout(options.source)
    scenes = chosen_scenes(options.scenes, usual_scenes(source))
    cache = options.cache or default_cache()
    native = load_native(source, cache)
    settings = {
        "repeats": options.repeats,
        "resolution": options.resolution,
        "spp": list(options.spp),
        "threads": [1],
    }
    figures = new_figures("tiles", machine_record(source, native), settings)

    def measure(loaded: BenchScene, scene: dict[str, Any]) -> None:
        scene["blocks"] = []
        for spp in options.spp:
            rows = list(
                measure_tiles(native, loaded, options.resolution, options.repeats, spp)
            )
            scene["blocks"].append({"spp": spp, "rows": rows})
            show(table_lines(scene["name"], spp, rows))

    measure_scenes(
        figures, scenes, lambda chosen: chosen.load(cache), measure, options.json
    )
    return True


def table_lines(scene: str, spp: int, rows: list[dict[str, Any]]) -> list[str]:
    """Markdown: CPU time over that with the usual options, by ITS, MTS and split factor."""
    by_options = {
        (row["traversal"], row.get("initial_tile"), row.get("minimum_tile"),
         row.get("split_factor")): row["ratio"]
        for row in rows
    }  # fmt: skip
    lines = []
    for traversal in TRAVERSALS:
        head = [f"MTS {minimum}" for minimum in MINIMUM_TILES]
        lines += ["", f"{scene}, {spp} spp, {traversal}", ""]
        lines.append(f"| ITS, split factor | {' | '.join(head)} |")
        lines.append("|---|" + "--:|" * len(head))
        for initial in INITIAL_TILES:
            for factor in SPLIT_FACTORS:
                cells = []
                for minimum in MINIMUM_TILES:
                    ratio = by_options.get((traversal, initial, minimum, factor))
                    cells.append("" if ratio is None else f"{ratio:.2f}")
                if any(cells):
                    lines.append(f"| {initial}, {factor} | {' | '.join(cells)} |")
    return lines
