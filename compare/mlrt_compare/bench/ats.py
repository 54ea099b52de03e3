"""Traversal steps: the figure by which the MLRTA paper compares ways through a tree."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

REDUCTIONS = {"office": 3.3, "conference": 2.4, "building": 2.2, "dragon-7.2M": 1.3}
"""The paper's: steps of packets from the root for each step with entry points."""
ENTRY_POINTS = (1, 8)
"""At most, for each tile: as in the paper, and as this project traces packets."""
CELL_STEPS = (1, 3)
"""What it counts as that a packet is clipped to the cell of a further entry point: a visit
of a node, or what the three pairs of planes take if each is like one."""


@dataclass(frozen=True)
class Steps:
    """For each 16 rays, all packets and searches together.

    search: nodes that searches of entry points visit. packets: nodes that packets visit,
    leaves included. leaves: these alone. cells: of further entry points that packets are
    clipped to. The first one's takes what the clipping to the scene's box takes from the
    root, which counts nowhere.
    """

    search: float
    cells: float
    packets: float
    leaves: float

    def total(self, cell_steps: int) -> float:
        """ATS (Reshetov et al. 2005, section 4), which knows no cells; each counts as
        `cell_steps` here."""
        return self.search + self.packets + cell_steps * self.cells


def counted_steps(tree: Any, view: Any, rays: int, options: dict[str, Any]) -> Steps:
    """Of primary rays, of which the view has so many."""
    counted = tree.count_primary(view, options)
    names = ("entry_steps", "frontier_tests", "traversal_steps", "leaf_visits")
    return Steps(*(16 * float(counted[name]) / rays for name in names))


def traversal_steps(tree: Any, view: Any, rays: int, options: dict[str, Any]) -> float:
    """ATS of primary rays, where a cell counts as one step."""
    return counted_steps(tree, view, rays, options).total(1)


def baselines(
    tree: Any, view: Any, rays: int, trace: dict[str, Any], scene: str
) -> dict[str, Any]:
    """ATS of single rays and of packets from the root, and what entry points save, as JSON
    has it. Packets are those of the paper: an interval for all rays.

    trace: options of the tracer, as far as they are not what is compared.
    """

    def from_root(traversal: str) -> Steps:
        options = {**trace, "traversal": traversal, "entry_points": False}
        return counted_steps(tree, view, rays, options)

    def from_entry_points(most: int) -> Steps:
        options = {**trace, "traversal": "interval", "entry_points": True}
        return counted_steps(tree, view, rays, {**options, "frontier": most})

    packets = from_root("interval")
    root = packets.total(1)
    goal = REDUCTIONS.get(scene)
    return {
        "single_rays_from_the_root": from_root("single").total(1),
        "packets_from_the_root": root,
        "leaves_from_the_root": packets.leaves,
        "with_entry_points": [
            row_of(root, from_entry_points(most), most, goal) for most in ENTRY_POINTS
        ],
        "goal": goal,
    }


def row_of(root: float, steps: Steps, most: int, goal: float | None) -> dict[str, Any]:
    """Steps with at most so many entry points a tile beside those of packets from the
    root: in all and how many times fewer, for each of CELL_STEPS, and why it misses a
    goal, None if it does not."""
    return {
        "entry_points": most,
        **asdict(steps),
        "counted": [
            {
                "cell_steps": cell_steps,
                "steps": steps.total(cell_steps),
                "reduction": root / steps.total(cell_steps),
                "why_below_goal": why_below(goal, root, steps, cell_steps),
            }
            for cell_steps in CELL_STEPS
        ],
    }


def why_below(goal: float | None, root: float, steps: Steps, cell_steps: int) -> str | None:
    """What keeps entry points from the goal; None if nothing does."""
    if goal is None or root / steps.total(cell_steps) >= goal:
        return None
    allowed = root / goal
    if steps.packets > allowed:
        return (
            f"packets alone visit {steps.packets:.2f} nodes from their entry points on, "
            f"more than the {allowed:.2f} steps of the goal"
        )
    return (
        f"packets visit {steps.packets:.2f} nodes, but {steps.search:.2f} of searches and "
        f"{cell_steps} * {steps.cells:.2f} of cells exceed the {allowed:.2f} steps of "
        "the goal"
    )
