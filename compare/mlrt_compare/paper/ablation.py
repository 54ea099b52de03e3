"""What each part of the method gives: rules of the tree, clipping, steps of the culling."""

from __future__ import annotations

import time
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
    MLRTA, and the frame of these with MLRTA on one thread; and whether all hit the
    same, see `StudiedScene.counters_and_hits`.

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
        counters, hits = studied.counters_and_hits(PAPER.options)
        first = hits if first is None else first
        one_image &= np.array_equal(first, hits)
        from_root = studied.unlit.render(**WITHOUT.options).counters
        for way, counted in ((PAPER, counters), (WITHOUT, from_root)):
            counts = counts_of(counted, "primary", studied.rays)
            row[way.key] = {"primary": counts.as_dict()}
        with thread_count(1):
            status = f"{scene.name}: frames, {name}"
            ways = [PAPER.options]
            (row["frame"],) = time_in_turns(studied.unlit, ways, 1, repeats, status)
        rows.append(row)
    return {"rows": rows, "one_image": bool(one_image)}


def ablate_culling(studied: StudiedScene, repeats: int) -> dict[str, Any]:
    """A row for each of CULLINGS: counts of primary rays, tiles that nothing was found for,
    and the frame without shadow rays on one thread; and whether all hit the same, see
    `StudiedScene.counters_and_hits`."""
    ways = {name: {**PAPER.options, **options} for name, options in CULLINGS.items()}
    rows = []
    first = studied.counters_and_hits(WITHOUT.options)[1]
    one_image = True
    took = []
    for name, options in ways.items():
        start = time.process_time()
        counters, hits = studied.counters_and_hits(options)
        took.append(time.process_time() - start)
        one_image &= np.array_equal(first, hits)
        rows.append(
            {
                "name": name,
                "options": CULLINGS[name],
                "primary": counts_of(counters, "primary", studied.rays).as_dict(),
                "tiles": counters["primary_tiles"],
                "missed_tiles": counters["primary_missed_tiles"],
            }
        )
    with thread_count(1):
        status = f"{studied.scene.name}: frames with other culling"
        ways_in_order = list(ways.values())
        frames = time_in_turns(studied.unlit, ways_in_order, 1, repeats, status, took)
    for row, frame in zip(rows, frames, strict=True):
        row["frame"] = frame
    return {"rows": rows, "one_image": bool(one_image)}
