"""The figures of `mlrt-bench rays` as text."""

from __future__ import annotations

from typing import Any

from .ats_table import entry_points, plural_steps, verdict
from .rays_goals import fastest_peer
from .speedup import MEDIANS, aims_text, best_frame, median_frame, ratio_lines, ratio_text
from .table import aligned, machine_lines, number, plural

COLUMNS = (
    *("", "call", "tile", "frame ms", "median", "CPU ms", "Mrays/s", "runs"),
    *("hit differs", "triangle", "shadow"),
)


MOST_FOR_EXACTNESS = 1.1
"""What watertight hits may take at most, over what single precision does; exact distances
are meant to fit in as well."""


def head_lines(machine: dict[str, Any], settings: dict[str, Any]) -> list[str]:
    side = settings["resolution"]
    return [
        *machine_lines(machine),
        f"frame: {side} x {side}; rays made, traced, shaded and stored; best of the runs "
        f"that others left alone, which are counted of all runs; {MEDIANS}; "
        "tile: rays along the side of what is handed over at once, the best of "
        f"{', '.join(map(str, settings['tiles']))}",
        *([f"Embree is limited to {machine['isa']}"] if settings["same_isa"] else []),
        "differs: rays for which MLRT and Embree differ in hit or miss, in the triangle, "
        "in whether the light is seen",
    ]


def work(spp: int, shadows: bool) -> str:
    return f"{spp} spp primary{' + shadow' if shadows else ''}"


def block_lines(scene: dict[str, Any], block: dict[str, Any]) -> list[str]:
    """The table of one scene, kind of rays and number of threads."""
    rays = sum(block["rays"].values())
    rows: list[tuple[str, ...]] = [COLUMNS]
    for contender in block["contenders"]:
        wall = best_frame(contender)
        differing = contender["differing"]
        runs = contender["runs"]
        rows.append(
            (
                contender["name"],
                contender["call"],
                str(contender["tile"]),
                number(1e3 * wall),
                number(1e3 * median_frame(contender)),
                number(1e3 * best_frame(contender, "cpu")),
                number(1e-6 * rays / wall),
                f"{sum(not run['busy'] for run in runs)}/{len(runs)}",
                *(str(differing[key]) for key in ("hit", "triangle", "lit")),
            )
        )
    lines = [
        "",
        f"{scene['name']}, {scene['triangles']} triangles, {plural(block['threads'])}, "
        f"{work(block['spp'], block['shadows'])}",
        *aligned(rows),
        f"  MLRT is {ratio_text(block['speedup'])} times as fast as "
        f"{fastest_peer(block)['name']}{aims_text(block['speedup'])}",
    ]
    costs = (
        ("watertightness", "watertightness alone takes"),
        ("exactness", "exactness, distances included, takes"),
    )
    lines += [
        f"  {what} {ratio_text(block[key])} times the time of single precision: at most "
        f"{MOST_FOR_EXACTNESS:g} is meant"
        for key, what in costs
        if block.get(key) is not None
    ]
    if not block["mlrt_tiles_give_one_image"]:
        lines.append("  MLRT's tiles do NOT give one image: this is a defect")
    return lines


def step_lines(scene: dict[str, Any]) -> list[str]:
    """ATS of the three baselines of a scene."""
    ats = scene["ats"]
    lines = [
        "  steps for 16 rays: single rays from the root "
        f"{number(ats['single_rays_from_the_root'])}, packets from the root "
        f"{number(ats['packets_from_the_root'])}"
    ]
    for row in ats["with_entry_points"]:
        for counted in row["counted"] if row["cells"] else row["counted"][:1]:
            cells = plural_steps(counted["cell_steps"])
            line = (
                f"  {entry_points(row)}, a cell {cells}: {number(counted['steps'])}, "
                f"{counted['reduction']:.2f} times fewer"
            )
            if ats["goal"] is not None:
                line += f", goal {ats['goal']:g} {verdict(counted)}"
            lines.append(line)
    return lines


def goal_lines(scenes: list[dict[str, Any]]) -> list[str]:
    """All ratios: a row a scene and number of threads, a column a kind of rays."""
    return ratio_lines(
        "MLRT / best Embree: best (median, CPU)",
        scenes,
        lambda block: work(block["spp"], block["shadows"]),
    )
