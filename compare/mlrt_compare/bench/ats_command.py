"""The command `mlrt-bench ats`: counts, no times."""

from __future__ import annotations

import argparse
from typing import Any

from mlrt_plugin.threads import thread_count

from . import ats_table
from .ats import baselines
from .checkout import find_checkout
from .figures import measure_scenes, new_figures, show, write_text
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .scenes import BenchScene, chosen_scenes, scenes_of_rays
from .status import show_status

USUAL_SCENES = ["office", "conference", "building", "dragon-7.2M"]
MINIMUM_TILES = (32, 16, 8)
"""MTS, of which the paper does not tell its own; the usual one first."""


def run(options: argparse.Namespace) -> bool:
    source = find_checkout(options.source)
    scenes = chosen_scenes(options.scenes or USUAL_SCENES, scenes_of_rays(source))
    cache = options.cache or default_cache()
    native = load_native(source, cache)
    side = options.resolution
    settings = {"resolution": side, "minimum_tiles": list(MINIMUM_TILES)}
    figures = new_figures("ats", machine_record(source, native), settings)

    def measure(loaded: BenchScene, scene: dict[str, Any]) -> None:
        show_status(f"{loaded.name}: counting steps")
        module = native.module
        with thread_count(max(options.threads)):
            mesh = module.Mesh(loaded.vertices, loaded.faces)
            tree = module.KdTree(mesh, {"builder": "auto"})
            view = module.View(loaded.view, side, side)
            blocks = [
                {
                    "minimum_tile": tile,
                    **baselines(
                        tree, view, side * side, {"minimum_tile": tile}, loaded.name
                    ),
                }
                for tile in MINIMUM_TILES
            ]
        show_status("")
        scene |= {
            "triangles": len(loaded.faces),
            "report": dict(tree.report),
            "blocks": blocks,
        }
        show(ats_table.scene_lines(scene))

    measure_scenes(
        figures, scenes, lambda chosen: chosen.load(cache), measure, options.json
    )
    summary = ats_table.summary_lines(figures["scenes"])
    show(summary)
    write_text(options.markdown, ats_table.markdown(figures))
    return True
