"""mlrt-bench tiles: what the sizes of tiles do to a frame; the usual are chosen by it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mlrt_plugin.threads import thread_count

from .measure import best, in_turns
from .native import Native
from .scenes import BenchScene
from .status import show_status

INITIAL_TILES = (16, 32, 64, 128, 256)
"""ITS, in rays along a side: the paper's range."""
MINIMUM_TILES = (4, 8, 16, 32, 64)
"""MTS, likewise."""
SPLIT_FACTORS = (4, 16)
TRAVERSALS = ("adaptive", "packet")


@dataclass
class Choice:
    """Options of the tracer, and CPU seconds of the frames with them."""

    options: dict[str, Any]
    frame_side: int
    """Rays along the side of the group that is traced in one call."""
    seconds: list[float] = field(default_factory=list)


def choices(traversal: str) -> list[Choice]:
    """The usual options first."""
    found = [Choice({"traversal": traversal}, 64)]
    for initial in INITIAL_TILES:
        for minimum in MINIMUM_TILES:
            if minimum > initial:
                continue
            for factor in SPLIT_FACTORS if minimum < initial else SPLIT_FACTORS[:1]:
                options = {
                    "traversal": traversal,
                    "initial_tile": initial,
                    "minimum_tile": minimum,
                    "split_factor": factor,
                }
                found.append(Choice(options, max(initial, 64)))
    return found


def measure_tiles(
    native: Native, scene: BenchScene, resolution: int, repeats: int, spp: int
) -> Iterator[dict[str, Any]]:
    """A row for each choice: options, and CPU seconds of the best frame, primary and shadow
    rays, on one thread, over those with the usual options. The tree has its wide form
    beforehand."""
    mesh = native.module.Mesh(scene.vertices, scene.faces)
    tree = native.module.KdTree(mesh, {"builder": "auto"})
    tree.widen()
    view = native.module.View(scene.view, resolution, resolution, 4 if spp == 16 else 1)
    image = np.zeros((resolution, resolution), np.float32)
    with thread_count(1):
        for traversal in TRAVERSALS:
            tried = choices(traversal)

            def run(choice: Choice) -> float:
                seconds = tree.render(view, choice.options, image, tile=choice.frame_side)
                return float(seconds.cpu)

            runs = [lambda choice=choice: run(choice) for choice in tried]
            for which, seconds in in_turns(runs, repeats):
                show_status(f"{scene.name}, {traversal}: {which + 1} of {len(tried)}")
                tried[which].seconds.append(seconds)
            show_status("")
            usual = best(tried[0].seconds)
            for choice in tried:
                yield {
                    **choice.options,
                    "ratio": best(choice.seconds) / usual,
                    "seconds": choice.seconds,
                }
