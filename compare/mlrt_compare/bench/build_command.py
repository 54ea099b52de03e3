"""The command `mlrt-bench build`."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from mlrt_plugin.errors import MlrtError
from mlrt_plugin.image_files import write_image

from . import build_table
from .build import SceneBenchmark, Settings
from .checkout import find_checkout
from .errors import BenchError
from .figures import measure_scenes, new_figures, show
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .scenes import BenchScene, chosen_scenes, usual_scenes


def run(options: argparse.Namespace) -> bool:
    """Returns whether MLRT's own trees agree."""
    source = find_checkout(options.source)
    scenes = chosen_scenes(options.scenes, usual_scenes(source))
    cache = options.cache or default_cache()
    native = load_native(source, cache)
    settings = Settings(options.threads, options.repeats, options.resolution)
    figures = new_figures("build", machine_record(source, native), asdict(settings))
    show(build_table.head_lines(figures["machine"], figures["settings"]))

    def measure(loaded: BenchScene, scene: dict[str, Any]) -> None:
        scene |= {"triangles": len(loaded.faces), "blocks": []}
        benchmark = SceneBenchmark(native, loaded, settings)
        for block in benchmark.blocks():
            scene["blocks"].append(block)
            scene |= benchmark.summary()
            show(build_table.block_lines(scene, block))
        show(build_table.scene_lines(scene))
        write_images(options.images, scene["name"], benchmark)

    measured = measure_scenes(
        figures, scenes, lambda chosen: chosen.load(cache), measure, options.json
    )
    show(build_table.goal_lines(figures["scenes"]))
    return all(scene["agreement"]["mlrt_trees_give_one_image"] for scene in measured)


def write_images(folder: Path | None, scene: str, benchmark: SceneBenchmark) -> None:
    if folder is None:
        return
    folder.mkdir(exist_ok=True)
    for name, frame in benchmark.frames.items():
        path = folder / f"{scene}-{name.replace(' ', '-').lower()}.png"
        try:
            write_image(path, np.repeat(frame.image[..., None], 3, axis=2))
        except MlrtError as error:
            raise BenchError(str(error)) from error
