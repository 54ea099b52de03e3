"""The sweep of the paper over tiles: ITS, MTS and split factor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from mlrt_plugin.threads import thread_count

from ..bench.status import show_status
from ..bench.tiles import INITIAL_TILES, MINIMUM_TILES, SPLIT_FACTORS
from .counts import counts_of
from .frame_times import time_in_turns
from .scenes import StudiedScene
from .ways import PAPER_SEARCH


@dataclass(frozen=True)
class Tiles:
    """Sizes that are tried, in rays along a side."""

    initial: Sequence[int] = INITIAL_TILES
    minimum: Sequence[int] = MINIMUM_TILES


def combinations(tiles: Tiles) -> list[dict[str, Any]]:
    """Options of the tracer: each that is one of its own. Where nothing is split the factor
    says nothing."""
    return [
        {"initial_tile": initial, "minimum_tile": minimum, "split_factor": factor}
        for initial in tiles.initial
        for minimum in tiles.minimum
        if minimum <= initial
        for factor in (SPLIT_FACTORS if minimum < initial else SPLIT_FACTORS[:1])
    ]


def sweep_tiles(studied: StudiedScene, tiles: Tiles, repeats: int) -> list[dict[str, Any]]:
    """A row for each combination with the paper's search and traversal: counts of primary
    rays and, where they are quick, with shadow rays, and the frame without shadow rays on
    one thread."""
    options = combinations(tiles)
    shadows = studied.shadows_are_quick
    kinds = ("primary", "primary_and_shadow") if shadows else ("primary",)
    rows = []
    for number, tried in enumerate(options):
        show_status(f"{studied.scene.name}: tiles, {number + 1} of {len(options)}")
        counters = studied.prepared(shadows).render(**PAPER_SEARCH, **tried).counters
        rows.append(
            {
                **tried,
                **{
                    kind: counts_of(counters, kind, studied.rays).as_dict()
                    for kind in kinds
                },
            }
        )
    with thread_count(1):
        frames = time_in_turns(
            studied.unlit,
            [{**PAPER_SEARCH, **tried} for tried in options],
            1,
            repeats,
            f"{studied.scene.name}: frames with other tiles",
        )
    for row, frame in zip(rows, frames, strict=True):
        row["frame"] = frame
    return rows
