"""Figures of a measurement of speed against error, as JSON has them, and the verdict."""

from __future__ import annotations

from typing import Any

import numpy as np

from .error_curves import Runs, equal_error, equal_time
from .speed_error import SpeedError, halves, spread

SLOPE_TOLERANCE = 0.02
"""Of a slope whose interval is so narrow that it misses -1 by less than matters; chosen."""
SAME_ERROR = (0.98, 1.02)
"""Ratios of MSE at equal samples that may be called the same estimator; chosen."""
PUBLISHABLE_SPREAD = 0.1
"""The greatest spread of times of the same that may be published."""


def figures_of(measured: SpeedError, machine: dict[str, Any]) -> dict[str, Any]:
    """All figures; None for what the curves do not reach."""
    runs = measured.runs[0]
    figures: dict[str, Any] = {
        "scene": str(measured.settings.scene),
        "width": measured.size[0],
        "height": measured.size[1],
        "sensor": measured.settings.sensor,
        "seed": measured.settings.seed,
        "defines": dict(measured.settings.defines),
        "threads": measured.threads,
        "rounds": measured.plan.rounds,
        "least_seconds": measured.plan.least_seconds,
        "machine": machine,
        "reference": {
            "spp": measured.references[1].spp,
            "mse_of_mitsubas": measured.references[1].mse,
            "mse_of_mlrts": measured.references[0].mse,
            "mse_between": mse_between(measured),
        },
        "sides": [side_figures(measured, side) for side in range(2)],
        "samples": [sample_figures(runs, index) for index in range(len(runs.spp))],
        "equal_time": runs.over_all(equal_time).as_dict(),
        "equal_error": runs.over_all(equal_error).as_dict(),
        "equal_time_spp": [runs.spp[i] for i in runs.indices_with(equal_time)],
        "equal_error_spp": [runs.spp[i] for i in runs.indices_with(equal_error)],
        "against_own_reference": {
            "equal_time": measured.runs[1].over_all(equal_time).as_dict(),
            "equal_error": measured.runs[1].over_all(equal_error).as_dict(),
        },
        "bias": measured.bias.as_dict(),
        "disputed_tiles": measured.disputed.as_dict() if measured.disputed else None,
        "break_even_frames": break_even(measured),
        "kernels_from_disk": measured.kernels_from_disk,
        "warnings": list(measured.warnings),
    }
    figures["disturbed"] = disturbed(figures)
    figures["reasons"] = reasons(figures, measured)
    figures["passed"] = not figures["reasons"]
    return figures


def side_figures(measured: SpeedError, side: int) -> dict[str, Any]:
    """What is told of one renderer."""
    cold, runs = measured.cold[side], measured.runs[0]
    points = []
    for index, spp in enumerate(runs.spp):
        seconds = runs.seconds[side, index]
        steady = float(np.median(seconds))
        points.append(
            {
                "spp": spp,
                "frames": measured.frames[index],
                "first": cold.first[index],
                "seconds": list(map(float, seconds)),
                "median": steady,
                "minimum": float(np.min(seconds)),
                "jit": max(cold.first[index] - steady, 0.0) if side == 1 else None,
                "spread": spread(list(seconds)),
                "a_against_a": halves(list(seconds)),
                "mse": float(np.mean(runs.mse[side, index])),
                "mse_runs": list(map(float, runs.mse[side, index])),
                "mse_against_own": float(np.mean(measured.runs[1].mse[side, index])),
                "rel_mse": float(np.mean(measured.rel_mse[side, index])),
                "efficiency": runs.efficiency(side, index).as_dict(),
            }
        )
    return {
        "name": measured.names[side],
        "load": cold.load,
        "build": cold.build,
        "points": points,
        "slope": runs.slope(side).as_dict(),
        "slope_against_own": measured.runs[1].slope(side).as_dict(),
    }


def sample_figures(runs: Runs, index: int) -> dict[str, Any]:
    """The factors at one number of samples, Mitsuba's over ours: above 1 we are better."""
    return {
        "spp": runs.spp[index],
        "time_at_equal_samples": runs.equal_samples_time(index).as_dict(),
        "mse_at_equal_samples": runs.equal_samples_error(index).as_dict(),
        "equal_time": runs.equal_time(index).as_dict(),
        "equal_error": runs.equal_error(index).as_dict(),
    }


def mse_between(measured: SpeedError) -> float:
    """Mean square difference of both references, the noise of both taken off; 0 or a
    little to either side of it if both converge to the same."""
    ours, theirs = measured.references
    return float(np.mean((ours.mean - theirs.mean) ** 2)) - ours.mse - theirs.mse


def break_even(measured: SpeedError) -> float | None:
    """Frames with the most samples after which what MLRT needs more to start, if it does,
    is won back; None if it is never."""
    starts = [cold.load + (cold.build or 0.0) for cold in measured.cold]
    ours, theirs = (
        float(np.median(measured.runs[0].seconds[side, -1])) for side in range(2)
    )
    if starts[0] <= starts[1]:
        return 0.0 if ours <= theirs else None
    return (starts[0] - starts[1]) / (theirs - ours) if ours < theirs else None


def disturbed(figures: dict[str, Any]) -> list[str]:
    """Which times are not to be published, as runs of the same differ too much."""
    return [
        f"{side['name']} at {point['spp']} spp"
        for side in figures["sides"]
        for point in side["points"]
        if max(point["spread"], point["a_against_a"]) > PUBLISHABLE_SPREAD
    ]


def reasons(figures: dict[str, Any], measured: SpeedError) -> list[str]:
    """Why the factors must not be called a speed-up, a phrase each."""
    found = []
    for number, side in enumerate(figures["sides"]):
        slope = measured.runs[0].slope(number)
        if slope.value is None:
            continue
        if not slope.holds(-1.0) and abs(slope.value + 1) > SLOPE_TOLERANCE:
            found.append(
                f"the MSE of {side['name']} falls with samples to the power of "
                f"{slope.value:.3f}, not of -1"
            )
    low, high = SAME_ERROR
    for index, spp in enumerate(measured.plan.spp):
        same = measured.runs[0].equal_samples_error(index)
        if same.value is None or not (same.holds(1.0) or low <= same.value <= high):
            value = "unknown" if same.value is None else f"{same.value:.3f}"
            found.append(
                f"at {spp} spp the ratio of both MSE is {value}, so the estimators are not "
                "the same"
            )
    if measured.disputed is None:
        return found + measured.bias.reasons()
    return found + measured.disputed.reasons()
