"""The figures of `mlrt-bench build` as text."""

from __future__ import annotations

from typing import Any

from .goals import best_of, counted_runs, median_of
from .measure import best
from .speedup import MEDIANS
from .table import aligned, machine_lines, megabytes, number, plural

COLUMNS = (
    *("", "build s", "CPU s", "frame s", "CPU s", "build + frame s", "runs"),
    *("MB", "bytes/tri", "wide s", "wide MB", "peak MB", "SAH cost", "ATS", "from root"),
)


def head_lines(machine: dict[str, Any], settings: dict[str, Any]) -> list[str]:
    return [
        *machine_lines(machine),
        f"frame: {settings['resolution']} x {settings['resolution']}, a primary ray a "
        "pixel and a shadow ray a hit; seconds: best (median) of the runs that others left "
        f"alone, which are counted of all runs; {MEDIANS}; wide: the "
        "form of the tree for rays that go alone, made after it",
    ]


def block_lines(scene: dict[str, Any], block: dict[str, Any]) -> list[str]:
    """The table of one scene and number of threads."""
    rows: list[tuple[str, ...]] = [COLUMNS]
    for contender in block["contenders"]:
        rows.append(contender_row(contender, scene))
    title = f"{scene['name']}, {scene['triangles']} triangles, {plural(block['threads'])}"
    return ["", title, *aligned(rows)]


def contender_row(contender: dict[str, Any], scene: dict[str, Any]) -> tuple[str, ...]:
    runs = counted_runs(contender)
    peak = scene["resident_peak_bytes"][contender["name"]]
    steps = scene["ats"].get(contender["name"], {})
    return (
        contender["name"],
        spread(contender, ("build",)),
        number(best(run["build"]["cpu"] for run in runs)),
        spread(contender, ("frame",)),
        number(best(run["frame"]["cpu"] for run in runs)),
        spread(contender, ("build", "frame")),
        f"{sum(not run['busy'] for run in runs)}/{len(contender['runs'])}",
        megabytes(contender["bytes"]),
        f"{contender['bytes'] / max(scene['triangles'], 1):.1f}",
        *wide_cells(contender),
        "-" if peak is None else megabytes(peak),
        number(scene["sah_cost"].get(contender["name"])),
        number(steps.get("with_entry_points")),
        number(steps.get("from_the_root")),
    )


def spread(contender: dict[str, Any], parts: tuple[str, ...]) -> str:
    """The best and the median of the seconds of parts of a run."""
    figures = (figure(contender, parts, "wall") for figure in (best_of, median_of))
    return "{} ({})".format(*map(number, figures))


def wide_cells(contender: dict[str, Any]) -> tuple[str, str]:
    """Seconds and bytes of the form for rays that go alone, where it was made."""
    if "wide_bytes" not in contender:
        return "-", "-"
    return spread(contender, ("wide",)), megabytes(contender["wide_bytes"])


def scene_lines(scene: dict[str, Any]) -> list[str]:
    """What holds for all numbers of threads of a scene."""
    agreement = scene["agreement"]
    differing = agreement["differing"]
    lines = [
        f"  of {agreement['pixels']} pixels MLRT and Embree differ in the triangle at "
        f"{differing['primitive']}, in hit or miss at {differing['hit']}, in brightness at "
        f"{differing['image']}"
    ]
    if not agreement["mlrt_trees_give_one_image"]:
        lines.append("  MLRT's trees do NOT give one image: this is a defect")
    share = scene["built_share"]
    if share:
        lines.append(
            f"  lazy: after the frame {100 * share['nodes']:.1f} % of the nodes and "
            f"{100 * share['references']:.1f} % of the references of the tree are built"
        )
    return lines


def goal_lines(scenes: list[dict[str, Any]]) -> list[str]:
    """All goals: a row a scene and number of threads, a column a goal."""
    rows: list[tuple[str, ...]] = []
    for scene in scenes:
        for block in scene.get("blocks", ()):
            goals = block["goals"]
            if not goals:
                continue
            if not rows:
                heads = [f"{goal['name']} <= {goal['limit']:g}" for goal in goals]
                rows.append(("goals: best (median)", *heads))
            name = f"{scene['name']}, {plural(block['threads'])}"
            rows.append((name, *(verdict(goal) for goal in goals)))
    return ["", *aligned(rows)] if rows else []


def verdict(goal: dict[str, Any]) -> str:
    ratio = f"{goal['best']:.2f}"
    if goal["median"] != goal["best"]:
        ratio += f" ({goal['median']:.2f})"
    return f"{ratio} {goal['verdict']}"
