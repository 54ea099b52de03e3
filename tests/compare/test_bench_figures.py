"""What mlrt-bench makes of raw runs: which ones count, goals, and the table."""

from __future__ import annotations

from typing import Any

import pytest
import repository
from bench_figures import block, run
from mlrt_compare.bench import build_table, table
from mlrt_compare.bench.frame_runs import FrameRun, measured_in_turns, needs_run
from mlrt_compare.bench.goals import Goal, best_of, counted_runs, goals_of, median_of
from mlrt_compare.bench.measure import Timing, in_turns
from mlrt_compare.bench.rays_contenders import (
    RayContender,
    Variant,
    choose_variant,
    ray_contenders,
)
from mlrt_compare.bench.rays_goals import (
    cost_of_exactness,
    cost_of_watertightness,
    ray_speedup,
)
from mlrt_compare.bench.speedup import Speedup, ratio_lines, speedup

QUIET = Timing(wall=1.0, cpu=1.9, waited=0.0)


def test_order_is_there_and_back_until_nobody_needs_to_run() -> None:
    left = {"A": 3, "B": 1, "C": 2}

    def runner(name: str) -> str | None:
        left[name] -= 1
        return name if left[name] >= 0 else None

    runs = [lambda n=name: runner(n) for name in left]
    assert "".join(name for _, name in in_turns(runs, 9)) == "ABCCAA"
    assert [which for which, _ in in_turns([lambda: "x"] * 2, 3)] == [0, 1, 1, 0, 0, 1]


@pytest.mark.parametrize(
    ("timing", "threads", "busy"),
    [
        (QUIET, 2, False),
        (Timing(1.0, 1.0, 0.0), 2, False),  # a serial part of the work is no disturbance
        (Timing(1.0, 0.5, 0.0), 1, True),
        (Timing(1.0, 1.9, 0.0), 1, True),
        (Timing(1.0, 1.0, 0.2), 2, True),
        (Timing(0.0, 0.0, 0.0), 1, True),
    ],
)
def test_disturbed_runs_are_found(timing: Timing, threads: int, busy: bool) -> None:
    assert timing.busy(threads) is busy


def test_disturbed_runs_count_only_if_there_are_no_others() -> None:
    runs = [run(9.0, 1.0, busy=True), run(2.0, 1.0), run(3.0, 1.0)]
    both = ("build", "frame")
    assert best_of({"runs": runs}, ("build",), "wall") == 2.0
    assert median_of({"runs": runs}, ("build",), "wall") == 2.5
    assert best_of({"runs": runs}, both, "cpu") == 3.0
    assert median_of({"runs": runs}, both, "cpu") == 3.5
    assert counted_runs({"runs": runs[:1]}) == runs[:1]


@pytest.mark.parametrize(
    ("walls", "median"),
    [
        ([58.7, 60.0, 61.0, 139.6, 140.0], 60.0),  # the two are left out
        ([58.7, 60.0, 76.0, 77.0], 60.0),  # so is the last: 1.3 * 58.7 = 76.3
        ([58.7, 60.0, 139.6, 140.0], 99.8),  # two are too few
    ],
)
def test_medians_are_of_runs_that_took_little_more_cpu_time_than_the_best(
    walls: list[float], median: float
) -> None:
    contender = {"runs": [run(1.0, wall) for wall in walls]}
    assert median_of(contender, ("frame",), "wall") == pytest.approx(median)
    assert best_of(contender, ("frame",), "wall") == 58.7
    assert len(contender["runs"]) == len(counted_runs(contender)) == len(walls)
    # Of either side alike.
    assert speedup(contender, [contender], None, None).median == 1


@pytest.mark.parametrize(
    ("best", "median", "verdict"),
    [(1.0, 1.0, "met"), (2.0, 2.0, "missed"), (0.9, 1.1, "open"), (1.1, 0.9, "open")],
)
def test_verdicts(best: float, median: float, verdict: str) -> None:
    assert Goal("a / b", best, median, 1.0).verdict == verdict
    assert Goal("a / b", best, median, 1.0, is_set=False).verdict == "not a goal"


def goals(scene: str, figures: dict[str, Any]) -> dict[str, Goal]:
    costs = {"MLRT exact": 50.0, "MLRT fast": 55.0}
    return {goal.name: goal for goal in goals_of(scene, figures, costs)}


def test_goals_are_the_ratios_that_they_name() -> None:
    figures = block(
        fast=[run(8.0, 1.0), run(10.0, 1.0)],
        lazy=[run(0.5, 1.0), run(0.5, 4.0)],
        high=[run(4.0, 1.0), run(2.0, 1.0)],
        medium=[run(1.0, 1.0), run(3.0, 1.0)],
    )
    figures["contenders"][1]["bytes"] = 3000
    figures["contenders"][3]["bytes"] = 2000
    found = goals("building", figures)
    expected = {
        "build fast / HIGH": (8 / 2, 9 / 3, 3.0),
        "bytes fast / MEDIUM": (1.5, 1.5, 1.5),
        "bytes fast / HIGH": (3.0, 3.0, 1.5),
        "build + frame lazy / MEDIUM": (1.5 / 2, 3 / 3, 1.0),
        "SAH cost fast / exact": (1.1, 1.1, 1.05),
    }
    assert found.keys() == expected.keys()
    for name, (best, median, limit) in expected.items():
        goal = found[name]
        assert (goal.best, goal.median, goal.limit) == pytest.approx((best, median, limit))
    assert [goal.verdict for goal in found.values()] == [
        *("open", "met", "missed", "met", "missed")
    ]


def test_lazy_growth_is_to_pay_in_large_scenes_only() -> None:
    name = "build + frame lazy / MEDIUM"
    assert not goals("office", block())[name].is_set
    assert goals("dragon-7.2M", block())[name].is_set


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "-"),
        (0, "0"),
        (1234.5, "1234"),
        (12.345, "12.35"),
        (1.234, "1.23"),
        (0.12345, "0.123"),
        (0.00012345, "0.000123"),
    ],
)
def test_numbers(value: float | None, text: str) -> None:
    assert table.number(value) == text


def test_columns_stand_below_one_another() -> None:
    lines = table.aligned([("", "a", "long head"), ("name", "12.5", "3")])
    assert lines == ["         a  long head", "name  12.5          3"]


def test_table_has_a_row_for_each_contender_and_tells_what_counted() -> None:
    figures = block(threads=2, fast=[run(7.0, 1.0), run(9.0, 1.0, busy=True)])
    names = [contender["name"] for contender in figures["contenders"]]
    scene = {
        "name": "office",
        "triangles": 10,
        "blocks": [figures],
        "resident_peak_bytes": dict.fromkeys(names, 5_000_000),
        "sah_cost": {"MLRT fast": 42.0},
        "ats": {"MLRT fast": {"with_entry_points": 11.0, "from_the_root": 22.0}},
    }
    scene["resident_peak_bytes"]["Embree HIGH"] = None
    lines = build_table.block_lines(scene, figures)
    assert lines[1] == "office, 10 triangles, 2 threads"
    rows = {" ".join(line.split()[:2]): line.split()[2:] for line in lines[3:]}
    assert rows.keys() == set(names)
    assert rows["MLRT fast"] == [
        *("7.00", "(7.00)", "7.00", "1.00", "(1.00)", "1.00", "8.00", "(8.00)", "1/2"),
        *("0.00100", "100.0", "-", "-", "5.00", "42.00", "11.00", "22.00"),
    ]
    fast = next(row for row in figures["contenders"] if row["name"] == "MLRT fast")
    fast["wide_bytes"] = 2_500_000
    for made, wall in zip(fast["runs"], (0.5, 0.25), strict=True):
        made["wide"] = {"wall": wall, "cpu": wall, "waited": 0.0}
    row = next(
        line for line in build_table.block_lines(scene, figures) if "MLRT fast" in line
    )
    # Of the run that others left alone.
    assert row.split()[13:16] == ["0.500", "(0.500)", "2.50"]
    assert rows["Embree HIGH"][-4:] == ["-"] * 4


def test_goals_form_a_table() -> None:
    figures = block(threads=2)
    figures["goals"] = [goal.as_dict() for goal in goals("building", figures).values()]
    other = {"name": "absent", "skipped": "there is no absent.xml"}
    lines = build_table.goal_lines([{"name": "building", "blocks": [figures]}, other])
    assert len(lines) == 3
    assert "build fast / HIGH <= 3" in lines[1]
    assert lines[2].startswith("building, 2 threads")
    assert lines[2].count("met") == 4 and lines[2].count("missed") == 1
    assert build_table.goal_lines([other]) == []


def frame_run(wall: float, frames: int = 1, busy: bool = False) -> FrameRun:
    return FrameRun(Timing(wall, 2 * wall, 0.0), frames, busy)


def test_frames_run_until_enough_were_left_alone_or_took_long() -> None:
    quiet, disturbed = frame_run(1.0), frame_run(1.0, busy=True)
    assert needs_run([disturbed, quiet], 2, enough=60.0)
    assert not needs_run([disturbed, quiet, quiet], 2, enough=60.0)
    assert needs_run([frame_run(9.0)], 2, enough=5.0)
    assert not needs_run([disturbed, frame_run(0.5, frames=10)], 2, enough=5.0)


def test_frames_are_taken_in_turns() -> None:
    seen: list[tuple[str, int]] = []

    def contender(name: str, number: int) -> FrameRun:
        seen.append((name, number))
        return frame_run(1.0, busy=name == "B" and number == 0)

    runs = measured_in_turns(
        [lambda n, name=name: contender(name, n) for name in "AB"], 2, enough=60.0
    )
    assert seen == [("A", 0), ("B", 0), ("B", 1), ("A", 1), ("B", 2)]
    assert [len(done) for done in runs] == [2, 3]


def frames_of(*walls: float) -> dict[str, Any]:
    return {"runs": [frame_run(wall).as_dict() for wall in walls]}


def test_speedup_is_beside_the_fastest_peer_by_each_figure() -> None:
    found = speedup(frames_of(1.0, 2.0), [frames_of(3.0, 9.0), frames_of(4.0, 5.0)], 3.0, 4)
    assert (found.best, found.median, found.cpu) == pytest.approx((3.0, 3.0, 3.0))
    assert (found.verdict, found.stretch_verdict) == ("met", "missed")


@pytest.mark.parametrize(
    ("best", "median", "goal", "verdict"),
    [
        (2.0, 2.0, 2.0, "met"),
        (1.9, 1.9, 2.0, "missed"),
        (2.1, 1.9, 2.0, "open"),
        (2.1, 1.9, None, "not a goal"),
    ],
)
def test_speedup_is_to_reach_its_goal(
    best: float, median: float, goal: float | None, verdict: str
) -> None:
    assert Speedup(best, median, 1.0, goal, None).verdict == verdict


def test_speedups_form_a_table() -> None:
    def figures(threads: int, kind: str, best: float) -> dict[str, Any]:
        one = Speedup(best, best, best, 2.0, 3.0)
        return {"threads": threads, "kind": kind, "speedup": one.as_dict()}

    scenes = [
        {"name": "office", "blocks": [figures(1, "a", 2.5), figures(2, "b", 3.5)]},
        {"name": "absent", "skipped": "there is no absent.xml"},
    ]
    lines = ratio_lines("ratios", scenes, lambda block: block["kind"])
    assert [" ".join(line.split()) for line in lines[1:]] == [
        "ratios a b",
        "office, 1 thread 2.50 (2.50, CPU 2.50): goal 2 met, stretch 3 missed -",
        "office, 2 threads - 3.50 (3.50, CPU 3.50): goal 2 met, stretch 3 met",
    ]
    assert ratio_lines("ratios", scenes[1:], lambda block: block["kind"]) == []


def test_every_mode_of_embree_is_tried_with_every_tile() -> None:
    tried = {
        contender.name: [(variant.call, variant.tile) for variant in contender.variants]
        for contender in ray_contenders(None, {"MEDIUM": None, "HIGH": None}, {}, (16, 64))
    }
    assert tried.pop("MLRT") == [("group", 16), ("group", 64)]
    for quality in ("MEDIUM", "HIGH"):
        assert tried.pop(f"Embree {quality} r16") == [("r16", 64)]
        streams = {call: tried.pop(f"Embree {quality} {call}") for call in ("NM", "1M")}
        assert streams["NM"] == [(f"NM{n}", tile) for n in (8, 16) for tile in (16, 64)]
        assert streams["1M"] == [("1M", 16), ("1M", 64)]
    assert not tried


def test_tiles_are_chosen_by_three_frames_that_are_taken_in_turns() -> None:
    cpu = {16: [3.0, 2.0, 2.0], 32: [2.0, 1.0, 9.0], 64: [2.5, 2.5, 1.5], 128: [3.1]}
    taken: list[int] = []

    def frame(variant: Variant) -> Timing:
        seconds = cpu[variant.tile][taken.count(variant.tile)]
        taken.append(variant.tile)
        return Timing(seconds, seconds, 0.0)

    contender = RayContender("MLRT", "", [Variant("group", t, print) for t in cpu])
    choose_variant(contender, frame)
    # 128 is more than 1.5 times what 32 takes after the first frame, 16 and 64 after two.
    assert taken == [16, 32, 64, 128, 16, 32, 64, 32]
    assert contender.chosen is not None and contender.chosen.tile == 32
    assert [trial["frames"] for trial in contender.tuning] == [2, 3, 2, 1]
    assert [trial["cpu"] for trial in contender.tuning] == [2.0, 1.0, 2.5, 3.1]


def test_quick_tiles_have_five_frames() -> None:
    contender = RayContender("MLRT", "", [Variant("group", t, print) for t in (16, 32)])
    choose_variant(contender, lambda variant: Timing(1e-3, 1e-3, 0.0))
    assert [trial["frames"] for trial in contender.tuning] == [5, 5]


def test_cost_of_exactness_is_told_of_the_same_runs() -> None:
    def contender(name: str, seconds: list[float]) -> dict[str, Any]:
        engine = name.split()[0]
        runs = [
            {"frame": {"wall": wall, "cpu": 2 * wall, "waited": 0.0}, "busy": False}
            for wall in seconds
        ]
        return {"name": name, "engine": engine, "runs": runs}

    own, embree = contender("MLRT", [3.0, 4.0, 6.0]), contender("Embree HIGH NM", [1.0])
    inexact = contender("MLRT inexact", [2.0, 2.0, 3.0])
    watertight = contender("MLRT watertight", [2.5, 3.0, 4.0])
    block = {"spp": 1, "shadows": False, "contenders": [own, embree, inexact, watertight]}
    assert cost_of_exactness(block) == {"best": 1.5, "median": 2.0, "cpu": 1.5}
    assert cost_of_watertightness(block) == {"best": 1.25, "median": 1.5, "cpu": 1.25}
    # They are nobody's peers.
    assert ray_speedup("office", block).best == pytest.approx(1 / 3)
    assert cost_of_exactness({**block, "contenders": [own, embree]}) is None
    assert cost_of_watertightness({**block, "contenders": [own, embree, inexact]}) is None


def test_the_plugin_is_exact() -> None:
    """Only further modules of the benchmarks are compiled with less exactness."""
    recipe = (repository.ROOT / "compare/benchmarks/CMakeLists.txt").read_text()
    for kind in ("inexact", "watertight"):
        macro = f"MLRT_{kind.upper()}"
        named = [
            path.relative_to(repository.ROOT).as_posix()
            for folder in ("cpp", "compare/benchmarks")
            for path in (repository.ROOT / folder).rglob("*")
            if path.is_file() and macro in path.read_text(errors="ignore")
        ]
        assert sorted(named) == [
            "compare/benchmarks/CMakeLists.txt",
            "cpp/base/exactness.h",
        ]
        assert recipe.count(macro) == 1
        assert f"target_compile_definitions(_bench_{kind} PRIVATE {macro})" in recipe
