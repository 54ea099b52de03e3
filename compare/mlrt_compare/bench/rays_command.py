"""The command `mlrt-bench rays`."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from . import rays_contenders as kinds
from . import rays_table
from .checkout import find_checkout
from .errors import BenchError
from .figures import measure_scenes, new_figures, show
from .machine import machine_record
from .native import INEXACT, WATERTIGHT, Native, load_native
from .options import default_cache
from .rays import RayBenchmark, Settings
from .scenes import BenchScene, chosen_scenes, scenes_of_rays

LESS_EXACT = {kinds.INEXACT: INEXACT, kinds.WATERTIGHT: WATERTIGHT}
"""Modules by the kind of MLRT that is in them."""


def run(options: argparse.Namespace) -> bool:
    """Returns whether MLRT gives the same image whatever the tiles."""
    source = find_checkout(options.source)
    scenes = chosen_scenes(options.scenes, scenes_of_rays(source))
    cache = options.cache or default_cache()
    native = load_native(source, cache)
    less_exact = {
        kind: load_native(source, cache, module)
        for kind, module in LESS_EXACT.items()
        if options.inexact
    }
    check_trace(native, options.trace)
    settings = Settings(
        options.threads,
        options.repeats,
        options.resolution,
        options.spp,
        options.tiles,
        options.trace,
        options.same_isa,
    )
    figures = new_figures("rays", machine_record(source, native), asdict(settings))
    show(rays_table.head_lines(figures["machine"], figures["settings"]))

    def measure(loaded: BenchScene, scene: dict[str, Any]) -> None:
        benchmark = RayBenchmark(native, loaded, settings, less_exact)
        scene |= {"triangles": len(loaded.faces), **benchmark.facts(), "blocks": []}
        for block in benchmark.blocks():
            scene["blocks"].append(block)
            show(rays_table.block_lines(scene, block))
        show(rays_table.step_lines(scene))

    measured = measure_scenes(
        figures, scenes, lambda chosen: chosen.load(cache), measure, options.json
    )
    show(rays_table.goal_lines(figures["scenes"]))
    return all(
        block["mlrt_tiles_give_one_image"]
        for scene in measured
        for block in scene["blocks"]
    )


def check_trace(native: Native, trace: dict[str, Any]) -> None:
    """Raises BenchError for options that the tracer does not have."""
    try:
        native.module.check_trace_options(trace)
    except (TypeError, ValueError) as error:
        raise BenchError(f"--trace is refused: {error}") from error
