"""mlrt-bench order: the rays are those it names, and both engines find the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from bench_command import assert_one_sentence, command
from mlrt_compare.bench.contenders import QUALITIES
from mlrt_compare.bench.native import Native
from mlrt_compare.bench.order import ARRAY_MODES, contenders, nanoseconds, orders_of
from mlrt_compare.bench.scenes import BenchScene

SIDE = 32
CONTENDERS = 1 + len(QUALITIES) * len(ARRAY_MODES)


def test_orders_hold_the_same_rays(native: Native, office: BenchScene) -> None:
    orders = orders_of(office, SIDE, contenders(native, office, 1)["MLRT"])
    lines, morton, shuffled, bounced = orders.values()
    pixels = lines[1].reshape(SIDE, SIDE, 3)
    # The first 16 in Morton order are the square of 4 x 4 at the corner.
    corner = {tuple(d) for d in pixels[:4, :4].reshape(-1, 3).tolist()}
    assert {tuple(d) for d in morton[1][:16].tolist()} == corner
    for origins, directions in (lines, morton, shuffled):
        assert np.ptp(origins, axis=0).max() == 0
        np.testing.assert_array_equal(
            np.unique(directions, axis=0), np.unique(lines[1], axis=0)
        )
    assert not np.array_equal(shuffled[1], lines[1])
    assert len(bounced[0]) <= SIDE * SIDE and np.ptp(bounced[0], axis=0).min() > 0
    unit = bounced[1] / np.linalg.norm(bounced[1], axis=1, keepdims=True)
    assert np.abs(unit.mean(axis=0)).max() < 5 / np.sqrt(3 * len(unit))


def test_embree_finds_what_mlrt_does(native: Native, office: BenchScene) -> None:
    tracers = contenders(native, office, 1)
    assert len(tracers) == CONTENDERS
    for origins, directions in orders_of(office, SIDE, tracers["MLRT"]).values():
        t, face = tracers["MLRT"](origins, directions)
        for trace in tracers.values():
            other_t, other_face = trace(origins, directions)
            same = face == other_face
            assert same.mean() > 0.99
            hit = same & np.isfinite(t)
            np.testing.assert_allclose(other_t[hit], t[hit], rtol=1e-4)


def test_nanoseconds_are_those_of_the_best_run_that_counts() -> None:
    def contender(name: str, *walls: float, busy: tuple[float, ...] = ()) -> dict:
        runs = [{"frame": {"wall": wall}, "busy": False} for wall in walls]
        return {
            "name": name,
            "runs": runs + [{"frame": {"wall": w}, "busy": True} for w in busy],
        }

    found = [
        contender("MLRT", 3e-3, 2e-3, busy=(1e-3,)),
        contender("Embree A", 5e-3),
        contender("Embree B", 9e-3, 4e-3),
    ]
    told = nanoseconds(found, 1000)
    assert told["mode"] == "Embree B"
    assert (told["MLRT"], told["Embree"]) == pytest.approx((2000, 4000))


def test_the_command_tells_and_keeps_it(
    native: Native, cache: Path, tmp_path: Path
) -> None:
    file = tmp_path / "order.json"
    child = command(
        "order", "--scenes", "office", "--resolution", SIDE, "--threads", 1,
        "--repeats", 1, "--cache", cache, "--json", file,
    )  # fmt: skip
    assert child.returncode == 0, child.stderr
    (scene,) = json.loads(file.read_text())["scenes"]
    (block,) = scene["blocks"]
    assert [row["order"] for row in block["rows"]] == [
        "camera, line by line",
        "camera, in Morton order",
        "camera, shuffled",
        "from hits, random directions",
    ]
    for row in block["rows"]:
        assert row["order"] in child.stdout
        assert len(row["contenders"]) == CONTENDERS and row["nanoseconds"]["MLRT"] > 0


def test_what_cannot_run_is_one_sentence(native: Native, cache: Path) -> None:
    assert_one_sentence(command("order", "--scenes", "none"), "there is no scene 'none'")
    child = command("order", "--scenes", "none.xml", "--cache", cache)
    assert_one_sentence(child, "nothing was measured")
