"""Seconds that pieces of work take, and whether they had the machine to themselves."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")

WAITING_LIMIT = 0.1
"""Share of the time that threads may stand in line for a processor; chosen, as the spread
that published figures may have."""
ROUNDS_A_REPEAT = 3
"""Runs that others disturb do not count and are repeated, within this limit; chosen."""
OWN_PROCESS = Path("/proc/self")


@dataclass(frozen=True)
class Timing:
    """Seconds of one piece of work."""

    wall: float
    cpu: float
    """Of all threads of the process."""
    waited: float
    """That threads stood in line for a processor, all together."""

    def busy(self, threads: int) -> bool:
        """Whether others had a part of the machine, so that the figure says little.

        Work that is ready to run gets the time of at least one processor, and of no more
        than it has threads.
        """
        ratio = self.cpu / max(self.wall, 1e-9)
        return (
            self.waited > WAITING_LIMIT * self.wall
            or ratio < 1 - WAITING_LIMIT
            or ratio > threads + WAITING_LIMIT
        )


@dataclass(frozen=True)
class Run:
    """A build and the first frame after it."""

    build: Timing
    frame: Timing
    busy: bool
    """Whether others had a part of the machine meanwhile."""
    wide: Timing | None = None
    """The making of the form for rays that go alone, where there is one; not part of the
    build, nor of the frame unless that came to need it."""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def waiting_seconds() -> float:
    """That the living threads of the process have stood in line so far."""
    total = 0
    for path in OWN_PROCESS.glob("task/*/schedstat"):
        try:
            total += int(path.read_text().split()[1])
        except (OSError, IndexError):  # a thread that has just ended, or a kernel without
            continue
    return 1e-9 * total


def timed(work: Callable[[], T], seconds_of: Callable[[T], Any]) -> tuple[T, Timing]:
    """Runs the work; `seconds_of` its result has the attributes `wall` and `cpu`."""
    before = waiting_seconds()
    result = work()
    waited = max(waiting_seconds() - before, 0.0)
    seconds = seconds_of(result)
    return result, Timing(float(seconds.wall), float(seconds.cpu), waited)


def process_timed(work: Callable[[], object]) -> Timing:
    """Runs the work; of the whole process."""
    waited, cpu, wall = waiting_seconds(), time.process_time(), time.perf_counter()
    work()
    wall = time.perf_counter() - wall
    cpu = time.process_time() - cpu
    return Timing(wall, cpu, max(waiting_seconds() - waited, 0.0))


def in_turns(
    runs: Sequence[Callable[[], T | None]], rounds: int
) -> Iterator[tuple[int, T]]:
    """Calls functions in the order A B C C B A A B C ..., once a round.

    A drift of the machine's speed weighs on all alike. Yields which one ran and its result,
    unless that is None, which means that it need not run again; ends after ``rounds``, or
    when none needs to.
    """
    for number in range(rounds):
        order = range(len(runs)) if number % 2 == 0 else reversed(range(len(runs)))
        ran = False
        for which in order:
            result = runs[which]()
            if result is not None:
                ran = True
                yield which, result
        if not ran:
            return


def best(values: Iterable[float]) -> float:
    return min(values)


def median(values: Iterable[float]) -> float:
    return statistics.median(values)
