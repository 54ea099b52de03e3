"""The section of the README on steps from entry points."""

from __future__ import annotations

from ..bench.markdown import table
from .tables import Figures, machines_of


def ats_lines(all_figures: Figures) -> list[str]:
    """`mlrt-bench ats`: what more than the paper's one entry point saves."""
    rows = []
    for figures in all_figures:
        for scene in figures["scenes"]:
            if scene["skipped"] is not None:
                continue
            block = scene["blocks"][0]
            line = [scene["name"], f"{block['packets_from_the_root']:.1f}"]
            for row in block["with_entry_points"]:
                # One entry point has no cells.
                counted = row["counted"] if row["cells"] else row["counted"][:1]
                line += [f"{each['reduction']:.2f}" for each in counted]
            rows.append([*line, "-" if block["goal"] is None else f"{block['goal']:g}"])
    return [
        "`mlrt-bench ats`, whole in [ats.md](compare/results/ats.md): how many times fewer "
        "steps packets take from one entry point a tile, and from up to eight, of which a "
        "packet is clipped to cells that count as one step or as three; primary rays, the "
        "default tree. One entry point saves less here than in the paper since it must "
        "hold all leaves that a tile's beam may enter, and in these scenes and views one "
        f"plane near the root often lies between them. {machines_of(all_figures)}.",
        "",
        *table(
            (
                *("scene", "from the root", "one entry point", "up to eight"),
                *("3 steps a cell", "paper"),
            ),
            rows,
        ),
    ]
