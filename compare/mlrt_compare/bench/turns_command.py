"""The command `mlrt-bench turns`."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

from .checkout import find_checkout
from .commits import commit_named, sources_of
from .figures import measure_scenes, new_figures, show
from .frame_runs import FrameSettings
from .machine import machine_record
from .native import compiled_native
from .options import default_cache
from .rays_table import work
from .scenes import BenchScene, chosen_scenes, scenes_of_rays
from .speedup import best_frame
from .table import aligned, machine_lines, number, plural
from .turns import BASE, NEW, measure_turns

COLUMNS = (
    *("", "base ms", "new ms", "best", "median", "CPU"),
    *("hit differs", "triangle", "shadow", "pixels"),
)


def run(options: argparse.Namespace) -> bool:
    """Returns whether all camera rays hit the same. Where shadow rays begin also depends on
    how the benchmark shades, which a commit may change as well."""
    source = find_checkout(options.source)
    base = commit_named(source, options.base)
    scenes = chosen_scenes(options.scenes, scenes_of_rays(source))
    cache = options.cache or default_cache()
    new = compiled_native(source, cache)
    libraries = {
        NEW: new.library,
        BASE: compiled_native(sources_of(source, base, cache), cache).library,
    }
    settings = FrameSettings(
        options.threads, options.repeats, options.resolution, options.spp
    )
    figures = new_figures("turns", machine_record(source, new), asdict(settings))
    figures["base"] = base
    show([*machine_lines(figures["machine"]), f"base: {base[:10]}; ratios: base / new"])

    def measure(loaded: BenchScene, scene: dict[str, Any]) -> None:
        scene |= {"triangles": len(loaded.faces), "blocks": []}
        for block in measure_turns(libraries, loaded, settings):
            scene["blocks"].append(block)
        show(scene_lines(scene))

    measured = measure_scenes(
        figures, scenes, lambda chosen: chosen.load(cache), measure, options.json
    )
    return not any(
        block["differing"][what]
        for scene in measured
        for block in scene["blocks"]
        for what in ("hit", "triangle")
    )


def scene_lines(scene: dict[str, Any]) -> list[str]:
    rows: list[tuple[str, ...]] = [COLUMNS]
    for block in scene["blocks"]:
        new, base = (best_frame(each) for each in block["contenders"])
        ratios, differing = block["speedup"], block["differing"]
        rows.append(
            (
                f"{work(block['spp'], block['shadows'])}, {plural(block['threads'])}",
                number(1e3 * base),
                number(1e3 * new),
                *(f"{ratios[key]:.3f}" for key in ("best", "median", "cpu")),
                *(str(differing[key]) for key in ("hit", "triangle", "lit", "image")),
            )
        )
    return ["", f"{scene['name']}, {scene['triangles']} triangles", *aligned(rows)]
