"""Timings of two renderers that share a machine."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

DEFAULT_ROUNDS = 3
"""Rounds of A B B A: six frames of each renderer, so one slow frame moves no median."""
FRAMES_OF_ROUND = 4
LEAST_SECONDS = 0.05
"""That a measurement over samples lasts: frames that take less are rendered in a row.
Chosen, as single frames of a few milliseconds differ by what wakes threads and interrupts
them."""


@dataclass(frozen=True)
class Timings:
    """Wall-clock seconds of one renderer."""

    load: float
    """From the scene file to memory, without ``build``."""
    build: float | None
    """Acceleration structure; None if the renderer does not tell it apart from ``load``."""
    first: float
    """First frame, with all that is done only once."""
    frames: tuple[float, ...]
    """The frames after the first."""
    kernels_compiled: int | None = None
    """Kernels that the first frame compiled; None for a renderer without a JIT compiler."""
    kernels_from_disk: int | None = None
    """Kernels that an earlier process had compiled."""

    @property
    def steady(self) -> float:
        """Median of the frames after the first."""
        return statistics.median(self.frames)

    @property
    def jit(self) -> float | None:
        """What tracing and compiling kernels took: the first frame without a steady one; 0
        if that took longer."""
        if self.kernels_compiled is None:
            return None
        return max(self.first - self.steady, 0.0)

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "steady": self.steady, "jit": self.jit}


def interleave(
    first: Callable[[], float], second: Callable[[], float], rounds: int
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Seconds that two functions report, called in the order A B B A, twice each a round.

    A drift of the machine's speed within a round weighs on both alike.
    """
    a: list[float] = []
    b: list[float] = []
    for _ in range(rounds):
        a.append(first())
        b.append(second())
        b.append(second())
        a.append(first())
    return tuple(a), tuple(b)


def frames_in_a_row(seconds: float, least: float = LEAST_SECONDS) -> int:
    """How many frames of so many seconds make a measurement of ``least`` or more."""
    return max(1, math.ceil(least / max(seconds, 1e-6)))
