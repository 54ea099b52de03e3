"""Frames of what is built already, measured in turns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

from .measure import ROUNDS_A_REPEAT, Timing, in_turns, waiting_seconds


@dataclass(frozen=True)
class FrameSettings:
    """What is measured of each scene: frames with each number of threads and samples."""

    threads: tuple[int, ...]
    repeats: int
    resolution: int
    """Pixels along both sides of the frame."""
    spp: tuple[int, ...]


@dataclass(frozen=True)
class FrameRun:
    """Frames in a row; the figures are those of one."""

    frame: Timing
    frames: int
    busy: bool
    """Whether others had a part of the machine meanwhile."""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def timed_frames(render: Callable[[], Any], count: int) -> Timing:
    """The mean of so many frames in a row; `render` returns seconds, wall and cpu."""
    before = waiting_seconds()
    frames = [render() for _ in range(count)]
    waited = max(waiting_seconds() - before, 0.0)
    return Timing(
        sum(frame.wall for frame in frames) / count,
        sum(frame.cpu for frame in frames) / count,
        waited / count,
    )


def needs_run(runs: Sequence[FrameRun], repeats: int, enough: float) -> bool:
    """Whether there are fewer than ``repeats`` runs that nobody disturbed, unless two or
    more have taken longer than ``enough`` seconds in all."""
    spent = sum(run.frame.wall * run.frames for run in runs)
    if len(runs) >= 2 and spent > enough:
        return False
    return sum(not run.busy for run in runs) < repeats


def measured_in_turns(
    contenders: Sequence[Callable[[int], FrameRun]], repeats: int, enough: float
) -> list[list[FrameRun]]:
    """Runs of each contender, which is told how many it has had, as many as `needs_run`
    wants."""
    done: list[list[FrameRun]] = [[] for _ in contenders]

    def run(which: int) -> FrameRun | None:
        if not needs_run(done[which], repeats, enough):
            return None
        return contenders[which](len(done[which]))

    runs = [partial(run, which) for which in range(len(contenders))]
    for which, result in in_turns(runs, ROUNDS_A_REPEAT * repeats):
        done[which].append(result)
    return done
