"""Tests whether two renderers have the same expected image, and the same noise.

Welch's t-test on the means of tiles, as Jung, Hanika and Dachsbacher propose (Detecting
Bias in Monte Carlo Renderers using Welch's t-test, JCGT 9(2), 2020): without bias the
p-values of the tiles are uniformly distributed, and a small bias shows in their histogram
before any pixel betrays it. The same test of the distances from the tile's median tells
whether the noise is the same (Brown and Forsythe, Robust Tests for the Equality of
Variances, 1974), which an F-test would tell of normal distributions only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import kstest
from scipy.stats import t as student

SIGNIFICANCE = 0.01
BINS = 20
ROUNDING = 1e-6
"""Share of a tile's mean, or of the image's if that is greater, that may be rounding: 17
roundings of single precision (2^-24 each), about what a sample takes from the hit to the
film; radiance is never negative, so that none is magnified by cancellation. With the same
random numbers, tiles of conference and living-room differ by a tenth of it at most, pixels
by two thirds."""
TESTS = 5
"""That share the significance."""


@dataclass(frozen=True)
class BiasTest:
    """What the tiles and the whole image say of two sets of independent renders."""

    tiles: int
    """Tiles with more noise than rounding."""
    quiet_tiles: int
    """All others, of which rounding may be the greater part of a difference."""
    differing_quiet: int
    """Quiet tiles that differ by more than rounding and noise explain together."""
    quiet_smallest_p: float
    """Smallest p-value of a quiet tile, of a difference beyond rounding, corrected by Sidak
    for their number; 1 without such tiles."""
    smallest_p: float
    """Smallest p-value of a tile, corrected by Sidak for their number; 1 without tiles."""
    uniform_p: float
    """p-value of the Kolmogorov-Smirnov test that the tiles' are uniform."""
    mean_p: float
    """p-value of the means of the images."""
    relative: float
    """Mean of the first over that of the second, minus 1."""
    interval: tuple[float, float]
    """99 % confidence interval of it."""
    spread_smallest_p: float
    """The same as ``smallest_p`` of the noise of the tiles."""
    variance_ratio: float
    """Variance of the tiles' means, all together, of the first over that of the second; 1
    without noise."""
    histogram: tuple[int, ...]
    """Numbers of tiles by p-value, from 0 to 1 in equal steps."""

    @property
    def passed(self) -> bool:
        return not self.reasons()

    def reasons(self) -> list[str]:
        """What speaks for a difference, a phrase each."""
        level = shared_level()
        found = []
        if self.smallest_p < level:
            found.append(f"a tile differs (p = {self.smallest_p:.2g} for all together)")
        if self.differing_quiet:
            found.append(
                f"{self.differing_quiet} of {self.quiet_tiles} tiles with less noise than "
                "rounding differ by more "
                f"(p = {self.quiet_smallest_p:.2g} for all together)"
            )
        if self.uniform_p < level:
            found.append(f"the tiles' p-values are not uniform (p = {self.uniform_p:.2g})")
        if self.mean_p < level:
            found.append(
                f"the means differ by {100 * self.relative:.3g} % (p = {self.mean_p:.2g})"
            )
        if self.spread_smallest_p < level:
            found.append(
                "the noise of a tile differs "
                f"(p = {self.spread_smallest_p:.2g} for all together)"
            )
        return found

    def as_dict(self) -> dict[str, Any]:
        return {
            "tiles": self.tiles,
            "quiet_tiles": self.quiet_tiles,
            "differing_quiet": self.differing_quiet,
            "quiet_smallest_p": self.quiet_smallest_p,
            "smallest_p": self.smallest_p,
            "uniform_p": self.uniform_p,
            "mean_p": self.mean_p,
            "relative_difference": self.relative,
            "relative_interval_99": list(self.interval),
            "spread_smallest_p": self.spread_smallest_p,
            "variance_ratio": self.variance_ratio,
            "p_histogram": list(self.histogram),
            "passed": self.passed,
            "reasons": self.reasons(),
        }


def bias_test(first: NDArray[np.float64], second: NDArray[np.float64]) -> BiasTest:
    """Tests two arrays (batches, TH, TW) of tile means, all of independent renders; at
    least two of each."""
    rounding = rounding_of(second)
    p, noisy = welch(first, second, rounding)
    means = [np.mean(tiles, axis=(1, 2)) for tiles in (first, second)]
    overall = float(np.mean(means[1]))
    difference = float(np.mean(means[0])) - overall
    variance = sum(float(np.var(mean, ddof=1)) / len(mean) for mean in means)
    degrees = len(means[0]) + len(means[1]) - 2
    deviation = variance**0.5
    half = float(student.ppf(0.995, degrees)) * deviation
    scale = overall or 1.0
    mean_p = 1.0
    if abs(difference) > ROUNDING * abs(overall):
        mean_p = (
            float(2 * student.sf(abs(difference) / deviation, degrees))
            if deviation
            else 0.0
        )
    tested, quiet = p[noisy], p[~noisy]
    distances = [np.abs(tiles - np.median(tiles, axis=0)) for tiles in (first, second)]
    spread_p = welch(distances[0], distances[1], rounding)[0][noisy]
    # Each tile at the level that Sidak's correction leaves it.
    quiet_level = 1 - (1 - shared_level()) ** (1 / max(quiet.size, 1))
    variances = [float(np.sum(np.var(tiles, axis=0))) for tiles in (first, second)]
    return BiasTest(
        tiles=int(np.count_nonzero(noisy)),
        quiet_tiles=quiet.size,
        differing_quiet=int(np.count_nonzero(quiet < quiet_level)),
        quiet_smallest_p=smallest_of_all(quiet),
        smallest_p=smallest_of_all(tested),
        uniform_p=float(kstest(tested, "uniform").pvalue) if len(tested) else 1.0,
        mean_p=mean_p,
        relative=difference / scale,
        interval=((difference - half) / scale, (difference + half) / scale),
        spread_smallest_p=smallest_of_all(spread_p),
        variance_ratio=variances[0] / variances[1] if variances[1] > 0 else 1.0,
        histogram=tuple(map(int, np.histogram(tested, BINS, (0, 1))[0])),
    )


def shared_level() -> float:
    """The significance of each test."""
    return float(1 - (1 - SIGNIFICANCE) ** (1 / TESTS))


def smallest_of_all(p: NDArray[np.float64]) -> float:
    """The smallest p-value of independent tests, corrected by Sidak for their number."""
    return float(1 - (1 - np.min(p, initial=1.0)) ** max(p.size, 1))


def rounding_of(tiles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(TH, TW) what may be rounding in the means of tiles (batches, TH, TW)."""
    means = np.abs(np.mean(tiles, axis=0))
    return np.asarray(ROUNDING * np.maximum(means, np.mean(means)))


def welch(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    rounding: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Two-sided p-values (TH, TW) of the tiles, and which of them have more noise than
    rounding. For those that have less, of the hypothesis that the means differ by no more
    than rounding: whatever difference within it is true, one beyond it has at most this
    probability. 0 or 1 without any noise.
    """
    shares = [np.var(tiles, axis=0, ddof=1) / len(tiles) for tiles in (first, second)]
    difference = np.abs(np.mean(first, axis=0) - np.mean(second, axis=0))
    variance = shares[0] + shares[1]
    noisy = variance > rounding**2
    beyond = np.where(noisy, difference, np.maximum(difference - rounding, 0))
    varies = variance > 0
    safe = np.where(varies, variance, 1.0)
    # Degrees of freedom by Welch and Satterthwaite; of shares of the variance, as the
    # square of a small one underflows.
    parts = [
        np.where(varies, share / safe, 1.0) ** 2 / (len(tiles) - 1)
        for share, tiles in zip(shares, (first, second), strict=True)
    ]
    p = 2 * student.sf(beyond / np.sqrt(safe), 1 / (parts[0] + parts[1]))
    p = np.where(varies, p, np.where(beyond > 0, 0.0, 1.0))
    return np.asarray(p), noisy
