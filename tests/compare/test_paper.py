"""mlrt-compare paper: its figures against what is known without it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository
from mlrt_compare.bench.frame_runs import FrameRun
from mlrt_compare.bench.measure import Timing
from mlrt_compare.bench.scenes import BenchScene
from mlrt_compare.cli import main
from mlrt_compare.paper.counts import counts_of
from mlrt_compare.paper.frame_times import summary
from mlrt_compare.paper.published import PUBLISHED, PublishedCounts
from mlrt_compare.paper.scenes import StudiedScene
from mlrt_compare.paper.sections import rate
from mlrt_compare.paper.study import sound
from mlrt_compare.paper.tables import count_ways
from mlrt_compare.paper.text import markdown
from PIL import Image as Pillow

SIDE = 64


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
