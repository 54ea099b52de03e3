"""All figures of one scene, as JSON has them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
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


PARTS = ("counts", "grouping", "rates", "culling", "tiles", "trees")
"""Of the figures of a scene, in the order in which they are measured."""


def study(scene: BenchScene, plan: Plan) -> Iterator[dict[str, Any]]:
    """Figures of the scene, part by part."""
    show_status(f"{scene.name}: building")
    with thread_count(max(plan.threads)):
        studied = StudiedScene(scene, plan.resolution)
        published = PUBLISHED.get(scene.name)
        yield {
            "triangles": len(scene.faces),
            "tree": studied.lit.report,
            "published": None if published is None else asdict(published),
        }
        yield {"counts": count_ways(studied)}
        yield {"grouping": compare_groupings(studied)}
    yield {"rates": frame_rates(studied, plan.threads, plan.repeats)}
    yield {"culling": ablate_culling(studied, plan.repeats)}
    yield {"tiles": sweep_tiles(studied, plan.tiles, plan.repeats)}
    del studied  # Large scenes have large trees: one at a time.
    yield {
        "trees": ablate_tree(scene, plan.resolution, plan.repeats, max(plan.threads)),
    }


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
