"""The ways through the tree that are compared: options of the tracer, by name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

PAPER_SEARCH: dict[str, Any] = {
    "traversal": "interval",
    "entry_points": True,
    "search_order": "paper",
    "frontier": 1,
}
"""The paper's traversal, with one entry point a tile, found in the paper's order."""
PAPER_TILES = {"initial_tile": 128, "minimum_tile": 32, "split_factor": 16}
"""Its best ITS and split factor. It does not tell the MTS; with 32 searches take about the
part of the steps that they take in its tables."""


@dataclass(frozen=True)
class Way:
    """key: in figures. name: in tables. options: fields of `TraceOptions`."""

    key: str
    name: str
    options: dict[str, Any]


WITHOUT = Way("without", "without MLRTA", {"traversal": "interval", "entry_points": False})
"""As the paper means it: the same packets, an interval for all rays of each, started at the
root; not single rays. ITS says only which rays are made together."""
PAPER = Way("with", "with MLRTA, as in the paper", {**PAPER_SEARCH, **PAPER_TILES})
FRONTIER = Way(
    "frontier",
    "with MLRTA, up to 8 entry points a tile",
    {"traversal": "interval", "entry_points": True},
)
SINGLE = Way(
    "single", "single rays, without MLRTA", {"traversal": "single", "entry_points": False}
)
PACKET_WITHOUT = Way(
    "packet_without",
    "an interval a ray, without MLRTA",
    {"traversal": "packet", "entry_points": False},
)
PACKET = Way("packet", "an interval a ray, up to 8 entry points", {"traversal": "packet"})
ADAPTIVE = Way("adaptive", "this project's default (beams)", {"traversal": "adaptive"})

COUNTED = (WITHOUT, PAPER, FRONTIER, PACKET_WITHOUT, PACKET, SINGLE)
"""Ways of packets and rays, whose steps mean the same."""
TIMED = (WITHOUT, PAPER, FRONTIER, PACKET_WITHOUT, PACKET, ADAPTIVE)
