"""mlrt-compare paper: its figures against what is known without it."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository
from mlrt_compare.bench.camera_rays import camera_rays
from mlrt_compare.bench.frame_runs import FrameRun
from mlrt_compare.bench.measure import Timing
from mlrt_compare.bench.scenes import BenchScene, imported
from mlrt_compare.cli import main
from mlrt_compare.paper import scenes as paper_scenes
from mlrt_compare.paper.ablation import ablate_culling, ablate_tree
from mlrt_compare.paper.counts import counts_of
from mlrt_compare.paper.frame_times import summary
from mlrt_compare.paper.grouping import groupings
from mlrt_compare.paper.published import PUBLISHED, PublishedCounts
from mlrt_compare.paper.rates import frame_rates
from mlrt_compare.paper.scenes import StudiedScene
from mlrt_compare.paper.sections import rate
from mlrt_compare.paper.study import sound
from mlrt_compare.paper.tables import count_ways
from mlrt_compare.paper.text import markdown
from mlrt_compare.paper.tile_sweep import Tiles, combinations, sweep_tiles
from mlrt_compare.paper.ways import PAPER, TIMED, WITHOUT
from PIL import Image as Pillow

OFFICE = repository.ROOT / "scenes" / "office" / "office.xml"
SIDE = 64


@pytest.fixture(scope="module")
def office() -> BenchScene:
    return imported("office", OFFICE)


@pytest.fixture(scope="module")
def studied(office: BenchScene) -> StudiedScene:
    return StudiedScene(office, SIDE)


@pytest.fixture(scope="module")
def counted(studied: StudiedScene) -> dict[str, Any]:
    return count_ways(studied)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run with small settings, on a scene that is there and one that is
    not."""
    folder = tmp_path_factory.mktemp("paper")
    options = ("--quick", "--resolution", SIDE, "--scenes", f"office,{folder}/none.xml")
    code = main(
        ["paper", *map(str, options), "--source", str(repository.ROOT), "-o", str(folder)]
    )
    assert code == 0
    return folder


def published_rows(kind: str) -> list[PublishedCounts]:
    return [getattr(scene, kind) for scene in PUBLISHED.values()]


def test_published_ratios_are_those_of_the_papers_text() -> None:
    primary = [round(counts.reduction, 2) for counts in published_rows("primary")]
    assert primary == [3.27, 2.39, 2.19, 1.29]
    both = [round(counts.reduction, 2) for counts in published_rows("with_shadows")]
    assert both == [2.47, 1.88, 1.70, 1.30]
    assert round(float(np.mean(primary[:3])), 2) == 2.62
    assert round(float(np.mean(both[:3])), 2) == 2.02


def test_published_steps_of_shadow_rays_alone() -> None:
    pairs = [(scene.with_shadows, scene.primary) for scene in PUBLISHED.values()]
    assert [round(both.steps - one.steps, 2) for both, one in pairs] == [
        *(6.09, 32.86, 36.55, 12.36)
    ]
    assert [round(both.steps_without - one.steps_without, 2) for both, one in pairs] == [
        *(11.83, 51.08, 45.85, 16.23)
    ]


def test_published_figures_are_those_of_the_specification() -> None:
    specification = repository.ROOT.parent / "shared" / "design" / "mlrta.md"
    if not specification.is_file():
        pytest.skip(f"there is no {specification}")
    text = specification.read_text().partition("## A.13")[2].partition("## A.14")[0]
    numbers = [
        [float(number) for number in re.findall(r"\d+\.\d+", line)]
        for line in text.splitlines()
    ]

    def primary(name: str) -> list[float]:
        return [getattr(counts, name) for counts in published_rows("primary")]

    assert primary("steps") in numbers
    assert primary("steps_without") in numbers
    assert primary("entry_steps") in numbers
    tests = zip(primary("tests"), primary("tests_without"), strict=True)
    assert [value for pair in tests for value in pair] in numbers
    for counts in published_rows("with_shadows"):
        assert f"{counts.steps:.2f}/{counts.steps_without:.2f}" in text
        assert f"{counts.tests:.2f}/{counts.tests_without:.2f}" in text
    for scene in PUBLISHED.values():
        for rates in (scene.rates, scene.shaded):
            if rates is not None:
                values = (rates.openrt, rates.one_thread, rates.two_threads)
                assert "/".join(f"{value:g}" for value in values) in text


def test_counts_are_for_each_packet_of_the_frame() -> None:
    counters = {
        **{"primary_entry_steps": 3, "primary_traversal_steps": 5},
        **{"primary_triangle_tests": 7, "primary_frontier_tests": 0},
        **{"shadow_entry_steps": 10, "shadow_traversal_steps": 20},
        **{"shadow_triangle_tests": 30, "shadow_frontier_tests": 40},
    }
    # 8 x 8 pixels are four packets of 4 x 4.
    assert counts_of(counters, "primary", 64).as_dict() == {
        **{"steps": 2.0, "entry_steps": 0.75, "tests": 1.75, "frontier_tests": 0.0}
    }
    both = counts_of(counters, "primary_and_shadow", 64)
    assert (both.steps, both.entry_steps, both.tests) == (38 / 4, 13 / 4, 37 / 4)


def test_entry_points_add_their_search_at_most(counted: dict[str, Any]) -> None:
    """A packet from an entry point visits a part of what it visits from the root."""
    without = counted["ways"]["without"]["primary"]
    assert without["entry_steps"] == 0 and without["steps"] > 1
    for way in ("with", "frontier"):
        found = counted["ways"][way]["primary"]
        assert found["entry_steps"] > 0
        assert found["steps"] - found["entry_steps"] < without["steps"]
        assert found["tests"] <= without["tests"]


def test_packets_visit_less_than_their_rays_do_and_more_than_one(
    counted: dict[str, Any],
) -> None:
    single = counted["ways"]["single"]["primary"]
    packets = counted["ways"]["packet_without"]["primary"]
    # A node that a ray visits its packet visits too, and no other.
    assert single["steps"] / 16 < packets["steps"] < single["steps"]
    # One interval for all rays visits what intervals of their own do, and more.
    assert packets["steps"] <= counted["ways"]["without"]["primary"]["steps"]


def test_all_ways_give_one_image_with_light_in_it(
    counted: dict[str, Any], studied: StudiedScene
) -> None:
    assert counted["one_image"]
    lit = studied.lit.render()
    dark = studied.unlit.render()
    assert lit.image.max() > 0 and dark.image.max() == 0
    assert dark.counters["shadow_packets"] == 0 < lit.counters["shadow_packets"]
    # The same camera rays, whether or not there is a light.
    assert dark.counters["primary_rays"] == lit.counters["primary_rays"] == SIDE**2


def test_run_writes_what_it_found_and_skips_by_name(run: Path) -> None:
    figures = json.loads((run / "paper.json").read_text())
    office, missing = figures["scenes"]
    assert office["skipped"] is None and "none.xml" in missing["skipped"]
    assert figures["machine"]["processor"] and figures["settings"]["resolution"] == SIDE
    ways = office["counts"]["ways"]
    counters = ways["with"]["counters"]
    steps = counters["primary_entry_steps"] + counters["primary_traversal_steps"]
    assert ways["with"]["primary"]["steps"] == pytest.approx(steps / (SIDE**2 / 16))


def test_tables_have_the_papers_figures_beside(run: Path) -> None:
    text = (run / "paper.md").read_text()
    figures = json.loads((run / "paper.json").read_text())
    ways = figures["scenes"][0]["counts"]["ways"]
    steps = ways["with"]["primary"]["steps"]
    assert f"| steps with MLRTA | {steps:.2f} | 3.98 |" in text
    both = ways["without"]["primary_and_shadow"]["steps"]
    assert f"| steps without | {both:.2f} | 24.83 |" in text
    assert "skipped: there is no" in text


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--scenes", "attic"), "there is no scene 'attic': choose from office"),
        (("--scenes", "no/such.xml"), "none of the scenes is there"),
        (("--resolution", "8"), "8 is less than 16"),
        (("-o", "no/such/folder"), "cannot be made"),
        (("--source", "no-such-source"), "not a source checkout"),
    ],
)
def test_what_cannot_run_is_one_sentence(
    arguments: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    source = () if "--source" in arguments else ("--source", str(repository.ROOT))
    assert main(["paper", *source, *arguments]) == 4
    error = capsys.readouterr().err.strip()
    assert said in error.splitlines()[-1]


def test_frames_are_timed_for_each_number_of_threads_and_kind_of_rays(run: Path) -> None:
    office = json.loads((run / "paper.json").read_text())["scenes"][0]
    found = [(block["threads"], block["shadows"]) for block in office["rates"]]
    assert found == [(1, False), (1, True), (2, False), (2, True)]
    for block in office["rates"]:
        for frame in block["ways"].values():
            walls = sorted(run["frame"]["wall"] for run in frame["runs"])
            # 1 / (1 / x) may be a rounding error away from x.
            rounding = 1 + 1e-9
            assert walls[0] / rounding <= 1 / frame["rate"] <= walls[-1] * rounding
            assert frame["left_alone"] <= frame["frames"] == len(walls)


def test_published_rates_stand_as_quoted(run: Path) -> None:
    text = (run / "paper.md").read_text()
    assert "| paper: OpenRT | 7.1 | 2.3 |  |  |" in text
    assert "| paper: MLRTA | 70.2 | 37.8 |  |  |" in text
    assert "| paper: MLRTA |  |  | 109.8 | 50.7 |" in text


def test_frames_that_others_disturb_are_marked_unless_others_were_left_alone() -> None:
    alone = FrameRun(Timing(2.0, 2.0, 0.0), 1, False)
    disturbed = FrameRun(Timing(8.0, 2.0, 6.0), 1, True)
    found = summary([alone, disturbed])
    assert (found["rate"], found["left_alone"], found["frames"]) == (0.5, 1, 2)
    assert rate(found) == "0.500"
    only = summary([disturbed])
    assert only["rate"] == 0.125 and rate(only).endswith("*")


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


def test_random_groups_cost_more_and_hit_the_same(run: Path) -> None:
    office = json.loads((run / "paper.json").read_text())["scenes"][0]
    assert office["grouping"]["same_hits"]
    groups = office["grouping"]["groupings"]
    for way in ("without", "with", "packet_without", "packet"):
        for kind in ("primary", "shadow"):
            costs = [group["ways"][way][kind]["steps"] for group in groups.values()]
            assert costs[0] < costs[1] <= 1.05 * costs[2], (way, kind)
    # The beam of random rays is that of all the view, which enters at the root, or just
    # below it where the camera is outside: the search is in vain.
    random = groups["random"]["ways"]
    without, found = random["without"]["primary"], random["with"]["primary"]
    visited = found["steps"] - found["entry_steps"]
    assert 0.99 * without["steps"] < visited <= without["steps"]


def test_other_hits_are_a_failure(run: Path) -> None:
    figures = json.loads((run / "paper.json").read_text())
    assert sound(figures)
    for part, verdict in (
        ("counts", "one_image"),
        ("trees", "one_image"),
        ("culling", "one_image"),
        ("grouping", "same_hits"),
    ):
        broken = json.loads((run / "paper.json").read_text())
        broken["scenes"][0][part][verdict] = False
        assert not sound(broken)
        assert "the figures mean nothing" in markdown(broken)


def test_plots_are_there(run: Path) -> None:
    for name in ("steps", "rates", "trees", "culling", "tiles", "grouping"):
        with Pillow.open(run / f"paper-{name}.png") as picture:
            assert min(picture.size) > 200
            # Something is drawn.
            assert len(picture.convert("RGB").getcolors(2**24) or ()) > 3


def test_pages_are_drawn_anew_from_the_figures(run: Path, tmp_path: Path) -> None:
    (tmp_path / "paper.json").write_text((run / "paper.json").read_text())
    assert main(["paper", "--redraw", "-o", str(tmp_path)]) == 0
    for name in ("paper.md", "paper-steps.png"):
        assert (tmp_path / name).read_bytes() == (run / name).read_bytes()


def test_figures_that_cannot_be_drawn_are_one_sentence(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "paper.json"
    unfinished = json.loads((run / "paper.json").read_text())
    del unfinished["scenes"][0]["trees"]
    for text, said in (
        (None, "cannot be read"),
        ("{", "cannot be read"),
        ('{"benchmark": "rays"}', "was not written by mlrt-compare paper"),
        (json.dumps(unfinished), "no scene that was measured to the end"),
    ):
        if text is not None:
            kept.write_text(text)
        assert main(["paper", "--redraw", "-o", str(tmp_path)]) == 4
        (line,) = capsys.readouterr().err.strip().splitlines()
        assert said in line
