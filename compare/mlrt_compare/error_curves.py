"""Time and error of two renderers over samples a pixel, with confidence intervals.

Celarek, Jakob, Wimmer and Lehtinen (Quantifying the Error of Light Transport Algorithms,
2019): many short runs tell the expected error and its spread, which one long run does not.
Intervals are of a bootstrap over rounds: a round holds a run of each renderer for each
number of samples, so what disturbs both stays together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 2000
CONFIDENCE = 0.95
BOOTSTRAP_SEED = 20_050_731
"""Chosen; intervals come out the same for the same runs."""
BEYOND = 1.25
"""A curve is continued up to this factor beyond its ends, which noise may move."""
LARGEST_FACTOR = 1e6
"""Chosen: what is larger comes from times that differ by noise only, whose steep line was
continued, and is no factor."""

Array = NDArray[np.float64]
Factor = Callable[[Array, Array, int], float | None]
"""Of (2, S) seconds and MSE and the number of an entry of S; None beyond the curves."""


@dataclass(frozen=True)
class Estimate:
    """A figure with its interval; None for what the curves do not reach."""

    value: float | None
    low: float | None = None
    high: float | None = None

    def as_dict(self) -> dict[str, float | None]:
        return {"value": self.value, "low": self.low, "high": self.high}

    def holds(self, value: float) -> bool:
        """Whether the interval contains a value."""
        if self.low is None or self.high is None:
            return False
        return self.low <= value <= self.high


@dataclass(frozen=True)
class Runs:
    """All runs of two renderers; of both axes 0 the first is ours."""

    spp: tuple[int, ...]
    seconds: Array
    """(2, S, rounds)."""
    mse: Array
    """(2, S, rounds), the reference's own noise taken off."""

    def estimate(self, figure: Callable[[Array, Array], float | None]) -> Estimate:
        """A figure of the (2, S) median seconds and mean MSE, with its interval."""
        value = figure(np.median(self.seconds, axis=-1), np.mean(self.mse, axis=-1))
        if value is None:
            return Estimate(None)
        rounds = self.seconds.shape[-1]
        generator = np.random.default_rng(BOOTSTRAP_SEED)
        found = []
        for _ in range(RESAMPLES):
            chosen = generator.integers(rounds, size=rounds)
            again = figure(
                np.median(self.seconds[..., chosen], axis=-1),
                np.mean(self.mse[..., chosen], axis=-1),
            )
            if again is not None:
                found.append(again)
        if len(found) < RESAMPLES / 2:
            return Estimate(value)
        tail = 50 * (1 - CONFIDENCE)
        low, high = np.percentile(found, (tail, 100 - tail))
        return Estimate(value, float(low), float(high))

    def efficiency(self, side: int, index: int) -> Estimate:
        """1 / (MSE seconds)."""
        return self.estimate(
            lambda seconds, mse: inverse(mse[side, index] * seconds[side, index])
        )

    def equal_samples_error(self, index: int) -> Estimate:
        """The other renderer's MSE over ours at equal samples: 1 for the same estimator."""
        return self.estimate(lambda _, mse: ratio(mse[1, index], mse[0, index]))

    def equal_samples_time(self, index: int) -> Estimate:
        """The other renderer's seconds over ours at equal samples."""
        return self.estimate(lambda seconds, _: ratio(seconds[1, index], seconds[0, index]))

    def equal_time(self, index: int) -> Estimate:
        """The other renderer's MSE over that which we reach in its time."""
        return self.estimate(lambda seconds, mse: equal_time(seconds, mse, index))

    def equal_error(self, index: int) -> Estimate:
        """The other renderer's seconds over those in which we reach its MSE."""
        return self.estimate(lambda seconds, mse: equal_time(mse, seconds, index))

    def indices_with(self, kind: Factor) -> list[int]:
        """At which numbers of samples the curves tell a factor."""
        seconds, mse = np.median(self.seconds, axis=-1), np.mean(self.mse, axis=-1)
        every = range(len(self.spp))
        return [index for index in every if kind(seconds, mse, index) is not None]

    def over_all(self, kind: Factor) -> Estimate:
        """Geometric mean of a factor over all numbers of samples that have it."""
        indices = self.indices_with(kind)

        def mean(seconds: Array, mse: Array) -> float | None:
            factors = [kind(seconds, mse, index) for index in indices]
            known = [factor for factor in factors if factor is not None]
            # Means of other samples are not the same figure.
            if not known or len(known) < len(indices):
                return None
            return float(np.exp(np.mean(np.log(known))))

        return self.estimate(mean)

    def slope(self, side: int) -> Estimate:
        """Of log MSE over log samples; -1 for independent samples without bias."""

        def fitted(_: Array, mse: Array) -> float | None:
            if len(self.spp) < 2 or not np.all(mse[side] > 0):
                return None
            return float(np.polyfit(np.log(self.spp), np.log(mse[side]), 1)[0])

        return self.estimate(fitted)


def equal_time(seconds: Array, mse: Array, index: int) -> float | None:
    """The other renderer's MSE at an index over ours at its time, ours interpolated in
    logarithms; None beyond our curve, and beyond LARGEST_FACTOR. With the arguments
    exchanged: the factor in time at equal error."""
    if not (np.all(mse > 0) and np.all(seconds > 0)):
        return None
    ours = interpolated(
        float(np.log(seconds[1, index])), np.log(seconds[0]), np.log(mse[0])
    )
    if ours is None:
        return None
    factor = float(np.log(mse[1, index])) - ours
    return float(np.exp(factor)) if abs(factor) < np.log(LARGEST_FACTOR) else None


def equal_error(seconds: Array, mse: Array, index: int) -> float | None:
    return equal_time(mse, seconds, index)


def interpolated(x: float, xs: Array, ys: Array) -> float | None:
    """The value at x of the polyline through the points, continued a little beyond its
    ends; None farther away, and for a single point unless it is there."""
    order = np.argsort(xs)
    xs, ys = xs[order], ys[order]
    beyond = float(np.log(BEYOND))
    if not xs[0] - beyond <= x <= xs[-1] + beyond:
        return None
    if len(xs) == 1:
        return float(ys[0]) if x == xs[0] else None
    upper = int(np.clip(np.searchsorted(xs, x), 1, len(xs) - 1))
    width = xs[upper] - xs[upper - 1]
    if width <= 0:
        return float(ys[upper])
    share = (x - xs[upper - 1]) / width
    return float(ys[upper - 1] + share * (ys[upper] - ys[upper - 1]))


def ratio(above: float, below: float) -> float | None:
    return float(above / below) if below > 0 else None


def inverse(value: float) -> float | None:
    return float(1 / value) if value > 0 else None
