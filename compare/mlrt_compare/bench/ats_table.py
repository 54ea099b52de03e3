"""The figures of `mlrt-bench ats` as Markdown."""

from __future__ import annotations

from typing import Any

from .ats import CELL_STEPS
from .markdown import table

HEAD = (
    *("", "search", "cells", "packets", "of them leaves"),
    *("steps", "ratio", "steps, 3 a cell", "ratio"),
)

INTRODUCTION = """\
# Traversal steps without and with entry points

Primary rays, {side} x {side}, one a pixel; counts are for each 16 rays, ATS = k / (W H /
16) of Reshetov, Soupikov and Hurley 2005, and do not depend on the machine. {machine}

Three baselines: single rays from the root; packets of 4 x 4 rays with one interval for all
(the paper's *without MLRTA*) from the root; the same packets from at most 1 (as in the
paper) or 8 entry points a tile. *search* counts nodes that searches visit, *packets* those
that packets visit, *cells* the cells of further entry points that packets are clipped to;
the clipping to the first is that to the scene's box without entry points. The paper has one
entry point and no cells. Here a cell counts as one step, like a node, and in the last two
columns as three: one for each axis. Ratios are steps of packets from the root for each step
with entry points. The tree is that of the default builder; initial tiles have 64 x 64 rays
and split into 4; minimum tile 32 is usual. This page is written by `mlrt-bench ats
--markdown FILE`.
"""

EXPLANATION = """\
Why one entry point saves less here than in the paper: it is the deepest node that holds all
leaves which a tile's beam may enter, so that a single plane near the root between two of
them keeps it high, whatever is below. That this is the reason shows in up to 8 entry
points, which follow both sides of such a plane: packets then visit a fraction of the nodes.
Searches hardly matter with minimum tile 32; smaller tiles have deeper entry points and
dearer searches, and gain or lose little in all. Scenes, views and trees are not the paper's
either: from the root its packets visit 13.00 nodes in its office, 49.98 in its conference,
71.37 in soda hall and 42.18 in its dragon. Leaves of the dragon are small beside a packet,
which visits many of its own; no entry point saves these.
"""


def steps_of(row: dict[str, Any]) -> list[str]:
    counted = [
        text
        for each in row["counted"]
        for text in (f"{each['steps']:.2f}", f"{each['reduction']:.2f}")
    ]
    return [f"{row[key]:.2f}" for key in ("search", "cells", "packets", "leaves")] + counted


def scene_lines(scene: dict[str, Any]) -> list[str]:
    """All baselines of a scene, and entry points with each minimum tile."""
    first = scene["blocks"][0]
    root = first["packets_from_the_root"]

    def from_root(name: str, steps: float, leaves: str) -> tuple[str, ...]:
        cells = [f"{steps:.2f}", f"{root / steps:.2f}"] * len(CELL_STEPS)
        return (name, "0.00", "0.00", f"{steps:.2f}", leaves, *cells)

    rows = [
        from_root("single rays from the root", first["single_rays_from_the_root"], ""),
        from_root("packets from the root", root, f"{first['leaves_from_the_root']:.2f}"),
    ]
    for block in scene["blocks"]:
        for row in block["with_entry_points"]:
            name = f"{entry_points(row)}, minimum tile {block['minimum_tile']}"
            rows.append((name, *steps_of(row)))
    return [
        "",
        f"## {scene['name']}, {scene['triangles']:,} triangles",
        "",
        *table(HEAD, rows),
    ]


def entry_points(row: dict[str, Any]) -> str:
    most = row["entry_points"]
    return "1 entry point" if most == 1 else f"up to {most} entry points"


def summary_lines(scenes: list[dict[str, Any]]) -> list[str]:
    """Whether the goals are met with the usual tile, and why not."""
    rows = []
    for scene in scenes:
        if scene["skipped"] is not None or scene["blocks"][0]["goal"] is None:
            continue
        usual = scene["blocks"][0]
        for row in usual["with_entry_points"]:
            for counted in row["counted"]:
                if row["cells"] == 0 and counted["cell_steps"] != CELL_STEPS[0]:
                    continue
                rows.append(
                    (
                        scene["name"],
                        entry_points(row),
                        plural_steps(counted["cell_steps"]) if row["cells"] else "no cells",
                        f"{usual['goal']:g}",
                        f"{counted['reduction']:.2f}",
                        verdict(counted),
                    )
                )
    if not rows:
        return []
    head = ("scene", "entry points", "a cell is", "goal", "ratio", "")
    return ["", "## Beside the paper's ratios", "", *table(head, rows)]


def plural_steps(steps: int) -> str:
    return "1 step" if steps == 1 else f"{steps} steps"


def verdict(counted: dict[str, Any]) -> str:
    why = counted["why_below_goal"]
    return "met" if why is None else f"missed: {why}"


def markdown(figures: dict[str, Any]) -> str:
    machine = figures["machine"]
    side = figures["settings"]["resolution"]
    by = f"MLRT {machine['mlrt']} at {(machine['commit'] or 'no commit')[:10]}."
    lines = [INTRODUCTION.format(side=side, machine=by).rstrip()]
    lines += [*summary_lines(figures["scenes"]), "", EXPLANATION.rstrip()]
    for scene in figures["scenes"]:
        if scene["skipped"] is None:
            lines += scene_lines(scene)
        else:
            lines += ["", f"{scene['name']}: skipped, {scene['skipped']}"]
    return "\n".join(lines) + "\n"
