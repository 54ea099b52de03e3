"""Traversal steps: the figure by which the MLRTA paper compares ways through a tree."""

from __future__ import annotations

from typing import Any

REDUCTIONS = {"office": 3.3, "conference": 2.4, "building": 2.2, "dragon-7.2M": 1.3}
"""The paper's: steps of packets from the root for each step with entry points."""


def traversal_steps(tree: Any, view: Any, rays: int, options: dict[str, Any]) -> float:
    """ATS: nodes visited for each 16 primary rays, those of entry point searches
    included (Reshetov et al. 2005, section 4)."""
    counted = tree.count_primary(view, options)
    steps = counted["entry_steps"] + counted["traversal_steps"]
    return 16 * float(steps) / rays


def baselines(
    tree: Any, view: Any, rays: int, trace: dict[str, Any], scene: str
) -> dict[str, float | None]:
    """ATS of single rays and of packets from the root, and with entry points, and what
    entry points save. Packets are those of the paper: an interval for all rays.

    trace: options of the tracer, as far as they are not what is compared.
    """

    def steps(traversal: str, entry_points: bool) -> float:
        options = {**trace, "traversal": traversal, "entry_points": entry_points}
        return traversal_steps(tree, view, rays, options)

    single, packets = steps("single", False), steps("interval", False)
    with_entry_points = steps("interval", True)
    return {
        "single_rays_from_the_root": single,
        "packets_from_the_root": packets,
        "with_entry_points": with_entry_points,
        "reduction": packets / with_entry_points,
        "goal": REDUCTIONS.get(scene),
    }
