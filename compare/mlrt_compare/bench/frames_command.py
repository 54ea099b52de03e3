"""The command `mlrt-bench frames`; ``llvm.activate`` comes before its import."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..llvm import LibLlvm
from . import frames_table
from .checkout import find_checkout
from .figures import measure_scenes, new_figures, show
from .frame_runs import FrameSettings
from .frames import FrameBenchmark
from .machine import machine_record
from .options import default_cache
from .scenes import SceneSource, chosen_scenes, scenes_of_rays

USUAL_SCENES = ["office", "conference"]


def run(options: argparse.Namespace, library: LibLlvm) -> bool:
    """Returns whether all images agree with Mitsuba's."""
    source = find_checkout(options.source)
    scenes = chosen_scenes(options.scenes or USUAL_SCENES, scenes_of_rays(source))
    cache = options.cache or default_cache()
    settings = FrameSettings(
        options.threads, options.repeats, options.resolution, options.spp
    )
    machine = {**machine_record(source, None), "llvm": library.name}
    figures = new_figures("frames", machine, asdict(settings))
    show(frames_table.head_lines(machine, figures["settings"]))

    def load(chosen: SceneSource) -> FrameBenchmark:
        path: Path = chosen.file(cache)
        return FrameBenchmark(chosen.name, path, settings)

    def measure(benchmark: FrameBenchmark, scene: dict[str, Any]) -> None:
        scene |= {**benchmark.facts(), "blocks": []}
        show(frames_table.scene_lines(scene))
        for block in benchmark.blocks():
            scene["blocks"].append(block)
            show(frames_table.block_lines(scene, block))

    measured = measure_scenes(figures, scenes, load, measure, options.json)
    show(frames_table.goal_lines(figures["scenes"]))
    return all(
        block["verdict"]["passed"] for scene in measured for block in scene["blocks"]
    )
