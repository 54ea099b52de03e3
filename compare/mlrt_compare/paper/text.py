"""The study as Markdown: each figure with that of the paper beside it."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any

from ..bench.markdown import row
from .published import PUBLISHED, PublishedCounts
from .sections import culling_lines, grouping_lines, rate_lines, tile_lines, tree_lines
from .study import MEASURED, PARTS, measured, sound
from .ways import COUNTED, PAPER, WITHOUT

SETTINGS = (
    "Counts are for each packet of 16 rays of the camera, also those of their shadow rays, "
    "as in the paper. *Without* MLRTA the same packets start at the root. *With* it their "
    f"traversal is the paper's, `{PAPER.options['traversal']}`, with one entry point a "
    f"tile, ITS {PAPER.options['initial_tile']}, MTS {PAPER.options['minimum_tile']} and "
    f"split factor {PAPER.options['split_factor']}; the paper does not tell its MTS.",
    "",
    "A shadow ray goes from one point light to each hit that faces it. Tiles are cut "
    "among them, so that with MLRTA their packets are not quite those without. One "
    "interval for all rays of a packet says little where these go apart, as shadow rays "
    "do over a silhouette: a few such packets visit much of the tree, and the more the "
    "larger it is. With an interval a ray they do not, see *Ways through the tree*.",
    "",
    "Scenes, views and lights are not those of the paper, which counts 1024 x 1024 "
    "pixels: compare ratios. Its tests, too, are of packets, not of rays, and leave out "
    "those that bounding boxes save. The mean gains of its text, 3.25 with primary rays "
    "and 2.75 with shadow rays over its first three scenes, are more than those of the "
    "steps in its tables, 2.62 and 2.01.",
)


def markdown(figures: dict[str, Any]) -> str:
    """The page, with the machine and what speaks against comparing with the paper."""
    lines = [*head_lines(figures)]
    for kind, title in (
        ("primary", "Table 1: primary rays"),
        ("primary_and_shadow", "Table 2: primary rays and shadow rays"),
    ):
        lines += ["", f"## {title}", "", *count_lines(figures, kind)]
    lines += ["", "## Table 3: frames a second", "", *rate_lines(measured(figures))]
    lines += ["", "## Ways through the tree", "", *way_lines(figures)]
    for title, section in (
        ("Rules of the tree, and clipping", tree_lines),
        ("Culling: steps 1 and 2, and the classic frustum test", culling_lines),
        ("Tiles", tile_lines),
        ("Control: random groups of rays", grouping_lines),
    ):
        lines += ["", f"## {title}", "", *section(measured(figures))]
    lines += ["", "## What measuring took", "", *measuring_lines(figures)]
    return "\n".join(lines) + "\n"


def head_lines(figures: dict[str, Any]) -> list[str]:
    machine, settings = figures["machine"], figures["settings"]
    side = settings["resolution"]
    lines = [
        "# The tables of the MLRTA paper",
        "",
        f"{side} x {side} pixels, one ray each; {machine['processor']}, "
        f"{machine['cores']} cores, load {machine['load'][0]:.1f}, {machine['time']}; MLRT "
        f"{machine['mlrt']} at {(machine['commit'] or 'no commit')[:10]} "
        f"({machine['isa']}).",
        "",
        *SETTINGS,
        "",
        "| scene | triangles | in the paper | triangles | nodes | references | SAH cost |",
        "|---|--:|---|--:|--:|--:|--:|",
    ]
    for scene in figures["scenes"]:
        if scene["skipped"] is not None:
            lines.append(f"| {scene['name']} | skipped: {scene['skipped']} | | | | | |")
            continue
        if scene not in measured(figures):
            lines.append(f"| {scene['name']} | not finished | | | | | |")
            continue
        published, tree = PUBLISHED.get(scene["name"]), scene["tree"]
        lines.append(
            row(
                scene["name"],
                f"{scene['triangles']:,}",
                published.name if published else "",
                published.triangles if published else "",
                f"{tree['inner_nodes'] + tree['leaves']:,}",
                f"{tree['references']:,}",
                f"{tree['sah_cost']:.1f}",
            )
        )
    if not sound(figures):
        lines += ["", "**Not all found the same hits, so the figures mean nothing.**"]
    return lines


def count_lines(figures: dict[str, Any], kind: str) -> list[str]:
    """Table 1 or 2, a pair of columns for each scene: measured, and published."""
    scenes = measured(figures)
    heads = [cell for scene in scenes for cell in (scene["name"], "paper")]
    lines = [row("", *heads), "|---|" + "--:|" * len(heads)]

    def add(name: str, own: Any, theirs: Any, form: str = "{:.2f}") -> None:
        cells = []
        for scene in scenes:
            ways = scene["counts"]["ways"]
            published = published_counts(scene["name"], kind)
            cells.append(form.format(own(ways[PAPER.key][kind], ways[WITHOUT.key][kind])))
            value = None if published is None else theirs(published)
            cells.append("" if value is None else form.format(value))
        lines.append(row(name, *cells))

    add("steps with MLRTA", lambda w, _: w["steps"], lambda p: p.steps)
    add("steps without", lambda _, o: o["steps"], lambda p: p.steps_without)
    add("of which search", lambda w, _: w["entry_steps"], lambda p: p.entry_steps)
    add("ratio", lambda w, o: o["steps"] / w["steps"], lambda p: p.reduction)
    add("tests with MLRTA", lambda w, _: w["tests"], lambda p: p.tests)
    add("tests without", lambda _, o: o["tests"], lambda p: p.tests_without)
    return [*lines, *mean_lines(scenes, kind)]


def mean_lines(scenes: Sequence[dict[str, Any]], kind: str) -> list[str]:
    """Means of the ratios, of scenes that the paper has too."""
    both = []
    for scene in scenes:
        published = published_counts(scene["name"], kind)
        if published is not None:
            ways = scene["counts"]["ways"]
            own = ways[WITHOUT.key][kind]["steps"] / ways[PAPER.key][kind]["steps"]
            both.append((own, published.reduction))
    if len(both) < 2:
        return []
    own, theirs = (statistics.fmean(ratios) for ratios in zip(*both, strict=True))
    return [
        "",
        f"The mean of the {len(both)} ratios is {own:.2f}, that of the paper's "
        f"{theirs:.2f}.",
    ]


def measuring_lines(figures: dict[str, Any]) -> list[str]:
    """Seconds of each part; parts of another commit than the page's are told by name."""
    scenes = [scene for scene in measured(figures) if MEASURED in scene]
    lines = [
        "Seconds of each part, and in brackets those of all processors together; a part "
        "takes more of the former where frames that others disturbed were repeated.",
        "",
        row("scene", *PARTS),
        "|---|" + "--:|" * len(PARTS),
    ]
    others = []
    for scene in scenes:
        records = [scene[MEASURED].get(part) for part in PARTS]
        cells = [
            "" if took is None else f"{took['seconds']:.0f} ({took['cpu_seconds']:.0f})"
            for took in records
        ]
        lines.append(row(scene["name"], *cells))
        others += [
            f"{part} of {scene['name']} at {(took['commit'] or 'no commit')[:10]}"
            for part, took in zip(PARTS, records, strict=True)
            if took is not None and took["commit"] != figures["machine"]["commit"]
        ]
    if others:
        lines += ["", f"Of other commits than the rest: {', '.join(others)}."]
    return lines


def published_counts(scene: str, kind: str) -> PublishedCounts | None:
    published = PUBLISHED.get(scene)
    if published is None:
        return None
    return published.primary if kind == "primary" else published.with_shadows


def way_lines(figures: dict[str, Any]) -> list[str]:
    """Steps, part of the search and tests of all ways, primary and shadow rays apart."""
    lines = [
        "Cells are those of further entry points that a packet is clipped to, which are no "
        "steps.",
    ]
    for kind, rays in (("primary", "primary rays"), ("shadow", "shadow rays")):
        lines += [
            "",
            f"| {rays} | scene | steps | of which search | cells | tests |",
            "|---|---|--:|--:|--:|--:|",
        ]
        for scene in measured(figures):
            for way in COUNTED:
                counts = scene["counts"]["ways"][way.key][kind]
                lines.append(row(way.name, scene["name"], *count_cells(counts)))
    return lines


def count_cells(counts: dict[str, float]) -> list[str]:
    """Steps, those of searches, cells of further entry points, and tests."""
    names = ("steps", "entry_steps", "frontier_tests", "tests")
    return [f"{counts[name]:.2f}" for name in names]
