"""All figures of one scene, as JSON has them."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import partial
from typing import Any

from mlrt_plugin.threads import thread_count

from ..bench.scenes import BenchScene
from ..bench.status import show_status
from .ablation import ablate_culling, ablate_tree
from .grouping import compare_groupings
from .published import PUBLISHED
from .rates import frame_rates
from .scenes import StudiedScene
from .tables import count_ways
from .tile_sweep import Tiles, sweep_tiles


@dataclass(frozen=True)
class Plan:
    """threads: numbers of them that frames are timed with; counts are the same with any.
    resolution: pixels along both sides of the frame, one ray each.
    repeats: frames of each that are timed. tiles: sizes that are tried.
    """

    threads: tuple[int, ...]
    resolution: int
    repeats: int
    tiles: Tiles


Found = Mapping[str, Any]
"""Figures of the scene so far."""
OF_ONE_TREE: dict[str, Callable[[StudiedScene, Plan, Found], Any]] = {
    "counts": lambda studied, plan, found: count_ways(studied),
    "grouping": lambda studied, plan, found: compare_groupings(studied),
    "rates": lambda studied, plan, found: frame_rates(
        studied, plan.threads, plan.repeats, found["counts"]["ways"]
    ),
    "culling": lambda studied, plan, found: ablate_culling(studied, plan.repeats),
    "tiles": lambda studied, plan, found: sweep_tiles(studied, plan.tiles, plan.repeats),
}
TREES = "trees"
PARTS = (*OF_ONE_TREE, TREES)
"""Of the figures of a scene, in the order in which they are measured."""


def study(
    scene: BenchScene,
    plan: Plan,
    commit: str | None,
    found: Found,
    parts: Collection[str] = PARTS,
) -> Iterator[dict[str, Any]]:
    """Figures of the scene, part by part, each with what its measuring took (`MEASURED`).

    commit: of the source that is measured. found: figures of the scene, to which whoever
    takes the parts adds them. parts: of PARTS; rates need counts, of found or of these.
    """
    of_one_tree = [part for part in OF_ONE_TREE if part in parts]
    if of_one_tree:
        show_status(f"{scene.name}: building")
        with thread_count(max(plan.threads)):
            studied = StudiedScene(scene, plan.resolution)
        published = PUBLISHED.get(scene.name)
        yield {
            "triangles": len(scene.faces),
            "tree": studied.lit.report,
            "published": None if published is None else asdict(published),
        }
        for part in of_one_tree:
            with thread_count(max(plan.threads)):
                yield timed_part(
                    part, commit, partial(OF_ONE_TREE[part], studied, plan, found)
                )
        del studied  # Large scenes have large trees: one at a time.
    if TREES in parts:
        threads = max(plan.threads)
        yield timed_part(
            TREES,
            commit,
            lambda: ablate_tree(scene, plan.resolution, plan.repeats, threads),
        )


MEASURED = "measured"
"""Of a scene: when each part was measured, in how many seconds, and of which commit."""


def timed_part(part: str, commit: str | None, measure: Callable[[], Any]) -> dict[str, Any]:
    start, cpu = time.perf_counter(), time.process_time()
    figures = measure()
    took = {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "seconds": round(time.perf_counter() - start, 3),
        "cpu_seconds": round(time.process_time() - cpu, 3),
        "load": os.getloadavg()[0],
        "commit": commit,
    }
    return {part: figures, MEASURED: {part: took}}


def add_part(scene: dict[str, Any], part: dict[str, Any]) -> None:
    """Adds what `study` yields to the figures of a scene."""
    records = {**scene.get(MEASURED, {}), **part.get(MEASURED, {})}
    scene |= part
    scene[MEASURED] = records


def sound(figures: dict[str, Any]) -> bool:
    """Whether all ways that were compared gave the same hits: else counts mean nothing."""
    return all(
        scene["counts"]["one_image"]
        and scene["culling"]["one_image"]
        and scene["trees"]["one_image"]
        and scene["grouping"]["same_hits"]
        for scene in measured(figures)
    )


def measured(figures: dict[str, Any]) -> list[dict[str, Any]]:
    """Scenes of which all parts are there."""
    return [scene for scene in figures["scenes"] if set(PARTS) <= scene.keys()]
