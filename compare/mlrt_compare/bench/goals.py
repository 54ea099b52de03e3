"""What the kd-tree is meant to reach beside Embree, and whether it does."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from .measure import best, median

LAZY_SCENES = ("building", "dragon")
"""Large ones, where a tree that is built where rays go is to pay."""
MOST_CPU = 1.3
"""Times the least CPU time of runs of the same; runs with more are taken for disturbed and
say nothing about a median. Chosen: of undisturbed ones almost all differ by less."""
LEAST_RUNS = 3
"""That a median is taken of before any is left out for its CPU time; chosen."""
Figure = Callable[[dict[str, Any], tuple[str, ...], str], float]
"""Of a contender: seconds of parts of its runs by a clock, wall or cpu."""
Block = dict[str, Any]
"""Figures of one number of threads, as `mlrt-bench build` writes them."""


@dataclass(frozen=True)
class Goal:
    """A ratio and its limit. Of seconds there are two, of the best runs and of the medians;
    a goal that only one of them reaches is left open. Some are set for some scenes only."""

    name: str
    best: float
    median: float
    limit: float
    is_set: bool = True

    @property
    def verdict(self) -> str:
        if not self.is_set:
            return "not a goal"
        return judged(self.best <= self.limit, self.median <= self.limit)

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "verdict": self.verdict}


def judged(by_best: bool, by_median: bool) -> str:
    """A verdict on a goal; it is open if only one of both figures reaches it."""
    if by_best != by_median:
        return "open"
    return "met" if by_best else "missed"


def counted_runs(contender: dict[str, Any]) -> list[dict[str, Any]]:
    """The runs that nobody disturbed; all if there is none."""
    runs: list[dict[str, Any]] = contender["runs"]
    return [run for run in runs if not run["busy"]] or runs


def undisturbed_runs(
    contender: dict[str, Any], parts: tuple[str, ...]
) -> list[dict[str, Any]]:
    """Of the runs that count, those of which medians are taken: without such that took much
    more CPU time than the best, as work does whose caches others use, whoever had the
    processor; all if too few were left. Of every contender alike."""
    runs = counted_runs(contender)
    cpu = [sum(run[part]["cpu"] for part in parts) for run in runs]
    limit = MOST_CPU * min(cpu)
    left = [run for run, took in zip(runs, cpu, strict=True) if took <= limit]
    return left if len(left) >= LEAST_RUNS else runs


def best_of(contender: dict[str, Any], parts: tuple[str, ...], clock: str) -> float:
    """Seconds of the parts of a run together; clock: wall or cpu."""
    runs = counted_runs(contender)
    return best(sum(run[part][clock] for part in parts) for run in runs)


def median_of(contender: dict[str, Any], parts: tuple[str, ...], clock: str) -> float:
    runs = undisturbed_runs(contender, parts)
    return median(sum(run[part][clock] for part in parts) for run in runs)


def goals_of(scene: str, block: Block, sah_costs: dict[str, float]) -> Iterator[Goal]:
    """The goals that the contenders of a block are there for.

    sah_costs: of MLRT's trees, by the name of the contender.
    """
    by_name = {contender["name"]: contender for contender in block["contenders"]}
    fast, lazy = by_name.get("MLRT fast"), by_name.get("MLRT lazy")
    medium, high = by_name["Embree MEDIUM"], by_name["Embree HIGH"]

    def of_seconds(
        name: str,
        limit: float,
        own: dict[str, Any],
        other: dict[str, Any],
        parts: tuple[str, ...],
        is_set: bool = True,
    ) -> Goal:
        def ratio(figure: Figure) -> float:
            return figure(own, parts, "wall") / figure(other, parts, "wall")

        return Goal(name, ratio(best_of), ratio(median_of), limit, is_set)

    def of_numbers(name: str, limit: float, own: float, other: float) -> Goal:
        return Goal(name, own / other, own / other, limit)

    if fast is not None:
        yield of_seconds("build fast / HIGH", 3.0, fast, high, ("build",))
        for peer, kind in ((medium, "MEDIUM"), (high, "HIGH")):
            yield of_numbers(f"bytes fast / {kind}", 1.5, fast["bytes"], peer["bytes"])
    if lazy is not None:
        yield of_seconds(
            "build + frame lazy / MEDIUM",
            1.0,
            lazy,
            medium,
            ("build", "frame"),
            is_set=scene.startswith(LAZY_SCENES),
        )
    if {"MLRT fast", "MLRT exact"} <= sah_costs.keys():
        yield of_numbers(
            "SAH cost fast / exact", 1.05, sah_costs["MLRT fast"], sah_costs["MLRT exact"]
        )
