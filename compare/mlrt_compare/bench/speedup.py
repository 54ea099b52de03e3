"""How many times as fast as a peer MLRT is, and is meant to be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from .goals import LEAST_RUNS, MOST_CPU, best_of, counted_runs, judged, median_of
from .table import aligned, plural

MEDIANS = (
    f"medians without those of more than {MOST_CPU:g} times the least CPU time, as long as "
    f"{LEAST_RUNS} are left"
)
"""Of which runs they are, for tables."""
FrameFigure = Callable[[dict[str, Any], str], float]


@dataclass(frozen=True)
class Speedup:
    """Seconds of a peer divided by MLRT's, and what they are meant to be at least."""

    best: float
    """Of the best runs on the clock."""
    median: float
    cpu: float
    """Of the best runs, time of all threads."""
    goal: float | None
    stretch: float | None

    @property
    def verdict(self) -> str:
        return self._reached(self.goal)

    @property
    def stretch_verdict(self) -> str:
        return self._reached(self.stretch)

    def _reached(self, limit: float | None) -> str:
        if limit is None:
            return "not a goal"
        return judged(self.best >= limit, self.median >= limit)

    def as_dict(self) -> dict[str, Any]:
        return {
            **asdict(self),
            "verdict": self.verdict,
            "stretch_verdict": self.stretch_verdict,
        }


def frame_seconds(contender: dict[str, Any], clock: str) -> list[float]:
    """Seconds of a frame in each run that counts; ``clock`` is wall or cpu."""
    return [run["frame"][clock] for run in counted_runs(contender)]


def best_frame(contender: dict[str, Any], clock: str = "wall") -> float:
    """Seconds of a frame in the best run that counts; ``clock`` is wall or cpu."""
    return best_of(contender, ("frame",), clock)


def median_frame(contender: dict[str, Any], clock: str = "wall") -> float:
    return median_of(contender, ("frame",), clock)


def speedup(
    own: dict[str, Any],
    peers: Sequence[dict[str, Any]],
    goal: float | None,
    stretch: float | None,
) -> Speedup:
    """Of a contender beside whichever of its peers is the fastest, by each figure."""

    def ratio(figure: FrameFigure, clock: str) -> float:
        return min(figure(peer, clock) for peer in peers) / figure(own, clock)

    return Speedup(
        best=ratio(best_frame, "wall"),
        median=ratio(median_frame, "wall"),
        cpu=ratio(best_frame, "cpu"),
        goal=goal,
        stretch=stretch,
    )


def ratio_text(figures: dict[str, Any]) -> str:
    """Of a speedup as JSON has it: best on the clock, median, and best in CPU time."""
    return f"{figures['best']:.2f} ({figures['median']:.2f}, CPU {figures['cpu']:.2f})"


def aims_text(figures: dict[str, Any]) -> str:
    """The goals that are set, with their verdicts."""
    parts = [
        f"{name} {figures[key]:g} {figures[verdict]}"
        for name, key, verdict in (
            ("goal", "goal", "verdict"),
            ("stretch", "stretch", "stretch_verdict"),
        )
        if figures[key] is not None
    ]
    return f": {', '.join(parts)}" if parts else ""


def ratio_lines(
    head: str,
    scenes: Sequence[dict[str, Any]],
    column_of: Callable[[dict[str, Any]], str],
) -> list[str]:
    """All speedups: a row a scene and number of threads, a column for each text that
    column_of makes of the blocks."""
    columns = list(
        dict.fromkeys(column_of(b) for scene in scenes for b in scene.get("blocks", ()))
    )
    cells: dict[tuple[str, int], dict[str, str]] = {}
    for scene in scenes:
        for block in scene.get("blocks", ()):
            text = ratio_text(block["speedup"]) + aims_text(block["speedup"])
            row = cells.setdefault((scene["name"], block["threads"]), {})
            row[column_of(block)] = text
    rows = [
        (f"{name}, {plural(threads)}", *(row.get(column, "-") for column in columns))
        for (name, threads), row in cells.items()
    ]
    return ["", *aligned([(head, *columns), *rows])] if rows else []
