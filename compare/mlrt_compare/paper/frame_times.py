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

ENOUGH_SECONDS = 6.0
"""Frames of a way that took longer than that in all are not repeated, once there are two;
chosen, for millions of triangles."""


def time_in_turns(
    prepared: PreparedScene,
    ways: Sequence[Mapping[str, Any]],
    threads: int,
    repeats: int,
    status: str,
) -> list[dict[str, Any]]:
    """For each way, options of the tracer, `summary` of its frames, after one that does
    not count. The pool must have as many threads."""

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
