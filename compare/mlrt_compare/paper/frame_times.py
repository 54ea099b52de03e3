"""Seconds of whole frames, of ways in turns."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from mlrt_plugin.render import PreparedScene

from ..bench.frame_runs import FrameRun, measured_in_turns
from ..bench.measure import Timing, best, median, waiting_seconds
from ..bench.status import show_status

ENOUGH_SECONDS = 4.0
"""Frames of a way that took longer than that in all are not repeated, once there are two;
chosen, for millions of triangles."""
SLOW_SECONDS = 20.0
"""Ways of which a frame takes longer are not timed; chosen. Few pixels of such a scene have
rays that go apart, but for these one interval visits most of the tree."""


def time_in_turns(
    prepared: PreparedScene,
    ways: Sequence[Mapping[str, Any]],
    threads: int,
    repeats: int,
    status: str,
    known: Sequence[float] = (),
) -> list[dict[str, Any]]:
    """For each way, options of the tracer, `summary` of its frames, after one that does
    not count. The pool must have as many threads.

    known: seconds that a frame of each way takes at least, if that is known; those above
    SLOW_SECONDS are told by `too_slow`.
    """
    if known:
        timed = [way for way, took in zip(ways, known, strict=True) if took <= SLOW_SECONDS]
        found = iter(time_in_turns(prepared, timed, threads, repeats, status))
        return [next(found) if took <= SLOW_SECONDS else too_slow(took) for took in known]

    def run(options: Mapping[str, Any], number: int) -> FrameRun:
        show_status(f"{status}, {number + 1} of {repeats}")
        timing = frame_timing(prepared, options)
        return FrameRun(timing, 1, timing.busy(threads))

    for options in ways:
        prepared.render(**options)
    runs = measured_in_turns(
        [partial(run, options) for options in ways], repeats, ENOUGH_SECONDS
    )
    show_status("")
    return [summary(done) for done in runs]


def too_slow(seconds: float) -> dict[str, Any]:
    """In place of a `summary`. seconds: that a frame takes at least."""
    return {"rate": None, "cpu": None, "least_seconds": seconds, "runs": []}


def frame_timing(prepared: PreparedScene, options: Mapping[str, Any]) -> Timing:
    waited, cpu, wall = waiting_seconds(), time.process_time(), time.perf_counter()
    prepared.render(**options)
    wall = time.perf_counter() - wall
    cpu = time.process_time() - cpu
    return Timing(wall, cpu, max(waiting_seconds() - waited, 0.0))


def summary(runs: Sequence[FrameRun]) -> dict[str, Any]:
    """Seconds of those frames that others left alone, or of all if there are none.

    rate: frames a second, by the median of the wall-clock times. cpu: the least of all
    threads together.
    """
    alone = [run for run in runs if not run.busy]
    counted = [run.frame for run in alone or runs]
    return {
        "rate": 1 / median(frame.wall for frame in counted),
        "best_rate": 1 / best(frame.wall for frame in counted),
        "cpu": best(frame.cpu for frame in counted),
        "frames": len(runs),
        "left_alone": len(alone),
        "runs": [run.as_dict() for run in runs],
    }
