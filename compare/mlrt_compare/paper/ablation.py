"""What each part of the method gives: rules of the tree, clipping, steps of the culling."""

from __future__ import annotations

from typing import Any

import numpy as np

from mlrt_plugin.threads import thread_count

from ..bench.scenes import BenchScene
from ..bench.status import show_status
from .counts import counts_of
from .frame_times import time_in_turns
from .scenes import StudiedScene
from .ways import PAPER, WITHOUT

NO_RULES = {"rule_empty_cell": False, "rule_flat_cell": False, "rule_area_floor": False}
TREES: dict[str, dict[str, Any]] = {
    "as usual": {},
    "no rule 1 (empty cells)": {"rule_empty_cell": False},
    "no rule 2 (flat cells)": {"rule_flat_cell": False},
    "no rule 3 (least area)": {"rule_area_floor": False},
    "none of the rules": NO_RULES,
    "no rules, no empty bonus": {**NO_RULES, "empty_bonus": 1.0},
    "no clipping": {"clip": False},
}
"""Options of the builder."""
CULLINGS: dict[str, dict[str, Any]] = {
    "steps 1 and 2": {"culling": "inverse_frustum", "leaf_rejection": "slopes"},
    "step 2 by parameters": {"culling": "inverse_frustum", "leaf_rejection": "parameters"},
    "step 1 alone": {"culling": "inverse_frustum", "leaf_rejection": "none"},
    "step 2 alone": {"culling": "none", "leaf_rejection": "slopes"},
    "neither": {"culling": "none", "leaf_rejection": "none"},
    "classic frustum test": {"culling": "frustum_planes"},
}
"""Options of the search for entry points, which are the paper's else."""
TREE_FACTS = ("inner_nodes", "leaves", "references", "sah_cost", "depth", "seconds")


def ablate_tree(scene: BenchScene, side: int, repeats: int, threads: int) -> dict[str, Any]:
    """A row for each of TREES: facts of the tree, counts of primary rays with and without
    MLRTA, and the frame of these with MLRTA on one thread; and whether the image with
    shadow rays was the same.

    Trees are built on ``threads``, one after another, as some are large.
    """
    rows = []
    first = None
    one_image = True
    for name, options in TREES.items():
        show_status(f"{scene.name}: tree, {name}")
        with thread_count(threads):
            studied = StudiedScene(scene, side, **options)
        report = studied.lit.report
        row: dict[str, Any] = {
            "name": name,
            "options": options,
            "tree": {fact: report.get(fact) for fact in TREE_FACTS},
        }
        result = studied.lit.render(**PAPER.options)
        first = result.image if first is None else first
        one_image &= np.array_equal(first.view(np.uint32), result.image.view(np.uint32))
        from_root = studied.unlit.render(**WITHOUT.options)
        for way, found in ((PAPER, result), (WITHOUT, from_root)):
            counts = counts_of(found.counters, "primary", studied.rays)
            row[way.key] = {"primary": counts.as_dict()}
        with thread_count(1):
            status = f"{scene.name}: frames, {name}"
            ways = [PAPER.options]
            (row["frame"],) = time_in_turns(studied.unlit, ways, 1, repeats, status)
        rows.append(row)
    return {"rows": rows, "one_image": bool(one_image)}


def ablate_culling(studied: StudiedScene, repeats: int) -> dict[str, Any]:
    """A row for each of CULLINGS: counts of primary rays, tiles that nothing was found for,
    and the frame without shadow rays on one thread; and whether the image with shadow rays
    was the same."""
    ways = {name: {**PAPER.options, **options} for name, options in CULLINGS.items()}
    rows = []
    first = studied.lit.render(**WITHOUT.options).image.view(np.uint32)
    one_image = True
    for name, options in ways.items():
        result = studied.lit.render(**options)
        one_image &= np.array_equal(first, result.image.view(np.uint32))
        rows.append(
            {
                "name": name,
                "options": CULLINGS[name],
                "primary": counts_of(result.counters, "primary", studied.rays).as_dict(),
                "tiles": result.counters["primary_tiles"],
                "missed_tiles": result.counters["primary_missed_tiles"],
            }
        )
    with thread_count(1):
        status = f"{studied.scene.name}: frames with other culling"
        frames = time_in_turns(studied.unlit, list(ways.values()), 1, repeats, status)
    for row, frame in zip(rows, frames, strict=True):
        row["frame"] = frame
    return {"rows": rows, "one_image": bool(one_image)}
