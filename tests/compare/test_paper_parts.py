"""Parts of mlrt-compare paper: ablations, tiles, groups of rays, and what is not timed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from mlrt_compare.bench.camera_rays import camera_rays
from mlrt_compare.bench.scenes import BenchScene
from mlrt_compare.paper import scenes as paper_scenes
from mlrt_compare.paper.ablation import ablate_culling, ablate_tree
from mlrt_compare.paper.grouping import groupings
from mlrt_compare.paper.rates import frame_rates
from mlrt_compare.paper.scenes import StudiedScene
from mlrt_compare.paper.sections import rate
from mlrt_compare.paper.tile_sweep import Tiles, combinations, sweep_tiles
from mlrt_compare.paper.ways import PAPER, TIMED, WITHOUT

SIDE = 64


@pytest.fixture(scope="module")
def studied(office: BenchScene) -> StudiedScene:
    return StudiedScene(office, SIDE)


def test_what_is_too_slow_is_not_timed_and_told_as_such(
    studied: StudiedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    counted = {way.key: {"cpu_seconds": 0.0} for way in TIMED}
    counted[WITHOUT.key]["cpu_seconds"] = 2 * 25.0
    single, double = frame_rates(studied, (1,), 1, counted)
    slow = double["ways"][WITHOUT.key]
    assert (single["shadows"], double["shadows"]) == (False, True)
    assert single["ways"][WITHOUT.key]["rate"] > 0
    assert slow["rate"] is None and slow["runs"] == [] and rate(slow) == "under 0.0200"
    assert all(
        frame["rate"] > 0 for key, frame in double["ways"].items() if key != WITHOUT.key
    )
    (_, both) = frame_rates(studied, (4,), 1, counted)
    assert both["ways"][WITHOUT.key]["rate"] > 0


def test_hits_are_held_against_each_other_with_shadow_rays_and_without(
    office: BenchScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    studied = StudiedScene(office, 32)
    for limit in (2**22, 1):
        monkeypatch.setattr(paper_scenes, "SHADOWED_TRIANGLES", limit)
        found = [studied.counters_and_hits(way.options) for way in (WITHOUT, PAPER)]
        assert np.array_equal(found[0][1], found[1][1])
        assert len(np.unique(found[0][1])) > 100
        assert (
            found[0][0]["primary_traversal_steps"] > found[1][0]["primary_traversal_steps"]
        )
    # A pixel that sees another face does not pass.
    moved = StudiedScene(dataclasses.replace(office, faces=office.faces[::-1].copy()), 32)
    assert not np.array_equal(moved.counters_and_hits(PAPER.options)[1], found[0][1])


def test_trees_without_a_part_of_the_builder_differ_as_they_must(
    office: BenchScene,
) -> None:
    found = ablate_tree(office, 32, 1, 1)
    assert found["one_image"]
    rows = {row["name"]: row for row in found["rows"]}
    usual = rows["as usual"]
    # A triangle's box reaches into more cells than the triangle does.
    assert rows["no clipping"]["tree"]["references"] > usual["tree"]["references"]
    # Without a least area cells go on being split.
    assert rows["no rule 3 (least area)"]["tree"]["leaves"] > usual["tree"]["leaves"]
    # Cells that rule 2 takes are leaves of their own that hold walls and floors.
    assert (
        rows["no rule 2 (flat cells)"]["without"]["primary"]["tests"]
        > (usual["without"]["primary"]["tests"])
    )


def test_each_step_of_the_culling_finds_deeper_entry_points(studied: StudiedScene) -> None:
    found = ablate_culling(studied, 1)
    assert found["one_image"]
    # What packets visit from the entry points.
    visited = {
        row["name"]: row["primary"]["steps"] - row["primary"]["entry_steps"]
        for row in found["rows"]
    }
    assert visited["steps 1 and 2"] <= visited["step 2 by parameters"]
    assert visited["step 2 by parameters"] <= visited["step 1 alone"]
    assert visited["step 1 alone"] <= visited["neither"]
    assert visited["steps 1 and 2"] <= visited["classic frustum test"]
    assert visited["steps 1 and 2"] < visited["neither"]


def test_tiles_are_each_combination_once() -> None:
    options = combinations(Tiles())
    assert len(options) == len({tuple(tried.values()) for tried in options})
    assert all(tried["minimum_tile"] <= tried["initial_tile"] for tried in options)
    # ITS 16, 32, 64, 128, 256 with MTS 4, 8, 16, 32, 64; the factor only where it matters.
    assert len(options) == 5 + 7 + 9 + 10 + 10


def test_smaller_tiles_take_more_search_and_leave_less_to_packets(
    studied: StudiedScene,
) -> None:
    rows = sweep_tiles(studied, Tiles((64,), (8, 32)), 1)
    by_tile = {
        row["minimum_tile"]: row["primary"] for row in rows if row["split_factor"] == 4
    }
    small, large = by_tile[8], by_tile[32]
    assert small["entry_steps"] > large["entry_steps"]
    assert small["steps"] - small["entry_steps"] <= large["steps"] - large["entry_steps"]


def test_tiles_of_large_scenes_are_counted_without_shadow_rays(
    studied: StudiedScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mlrt_compare.paper.scenes.SHADOWED_TRIANGLES", 10)
    (row,) = sweep_tiles(studied, Tiles((32,), (32,)), 1)
    assert row["primary"]["steps"] > 0 and "primary_and_shadow" not in row


def test_camera_rays_hit_what_the_image_shows(studied: StudiedScene) -> None:
    """Those of the control are the renderer's, through the centres of pixels: only where
    an edge passes through a pixel may its jittered ray meet another face."""
    rays = camera_rays(studied.lit.arrays.camera, SIDE)
    hits = studied.lit.tree.closest_hit(*rays.ordered(np.arange(SIDE * SIDE)), {})
    seen = studied.lit.render(aovs=("prim",)).aovs["prim"].ravel()
    assert np.mean(hits[1] == seen) > 0.8
    mirrored = seen.reshape(SIDE, SIDE)[:, ::-1].ravel()
    assert np.mean(hits[1] == mirrored) < 0.5


def test_groupings_are_of_pixels_each_once() -> None:
    orders = groupings(64, 16, 1, triangles=800)
    neighbours, within, random = orders.values()
    assert np.array_equal(np.sort(neighbours), np.arange(64 * 64))
    for order in (within, random):
        assert len(np.unique(order)) == len(order)
    # The first tile of neighbours is a square; one of random rays is not.
    for order, is_square in ((neighbours, True), (within, True), (random, False)):
        rows, columns = np.divmod(order[: 16 * 16], 64)
        square = np.ptp(rows) == np.ptp(columns) == 15
        assert square == is_square
    # Within a tile packets of 4 x 4 pixels are torn apart.
    rows, columns = np.divmod(neighbours[:16], 64)
    assert np.ptp(rows) == np.ptp(columns) == 3
    rows, columns = np.divmod(within[:16], 64)
    assert np.ptp(rows) > 3 and np.ptp(columns) > 3


def test_random_groups_are_smaller_in_large_scenes() -> None:
    def sizes(triangles: int) -> list[int]:
        return [len(order) for order in groupings(256, 32, 1, triangles).values()]

    assert sizes(282_238) == [256**2, 2**14, 2**11]
    assert sizes(2_200_000) == [256**2, 3 * 32**2, 480]
    assert sizes(7_200_000) == [256**2, 32**2, 256]
