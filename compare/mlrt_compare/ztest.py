"""Tests whether an image has the expected values that a reference says.

The test of pixels is the one that Mitsuba judges its own renders by
(src/render/tests/test_renders.py of version 3.9): z = |mean - reference| /
sqrt(variance / spp), the variance of a sample at least 1e-4; a pixel's channel passes if
its two-sided p-value exceeds the significance of 1 %, corrected by Sidak for as many tests
as there are pixels; the image passes if 99.75 % of all channels of pixels do. It knows no
noise of the reference, and is blind to a small loss everywhere, which the test of the mean
finds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from .metrics import Image

SIGNIFICANCE = 0.01
PASSING_SHARE = 0.9975
VARIANCE_FLOOR = 1e-4
"""Of a sample, in units of radiance squared: the reference's estimate may be 0."""
ROUNDING = 1e-6
"""Differences of the means by less than this share of the reference's are rounding."""


@dataclass(frozen=True)
class ZTest:
    """What the tests of the pixels and of the mean say."""

    spp: int
    alpha: float
    """Significance of a pixel's test."""
    passing: float
    """Share of the pixels' channels that pass."""
    smallest_p: float
    mean_z: tuple[float, ...]
    """Standard scores of the means of the channels, over all pixels."""
    mean_p: float
    """p-value of the largest of them, corrected by Sidak."""
    p_values: NDArray[np.float64]
    """(H, W, C)."""

    @property
    def pixels_pass(self) -> bool:
        """Mitsuba's rule."""
        return self.passing >= PASSING_SHARE

    @property
    def mean_passes(self) -> bool:
        return self.mean_p > SIGNIFICANCE

    def reasons(self) -> list[str]:
        """What fails, a phrase each."""
        found = []
        if not self.pixels_pass:
            found.append(
                f"z-test: {100 * self.passing:.4f} % of the pixels' channels pass, at "
                f"least {100 * PASSING_SHARE:g} % must"
            )
        if not self.mean_passes:
            largest = max(self.mean_z, key=abs)
            found.append(
                f"the mean of a channel is {abs(largest):.1f} standard deviations too "
                f"{'bright' if largest > 0 else 'dark'} (p = {self.mean_p:.2g})"
            )
        return found

    def as_dict(self) -> dict[str, Any]:
        return {
            "spp": self.spp,
            "significance": SIGNIFICANCE,
            "alpha": self.alpha,
            "passing_share": self.passing,
            "required_share": PASSING_SHARE,
            "smallest_p": self.smallest_p,
            "pixels_pass": self.pixels_pass,
            "mean_z": list(self.mean_z),
            "mean_p": self.mean_p,
            "mean_passes": self.mean_passes,
        }


def z_test(
    image: Image,
    reference: Image,
    variance: Image,
    spp: int,
    *,
    reference_spp: float = math.inf,
) -> ZTest:
    """Tests an image of ``spp`` samples a pixel, all three (H, W, C) and of one colour
    space.

    variance: of a single sample, in units of radiance squared; negative values count as 0.
    reference_spp: samples a pixel of the reference; infinite for one without noise, as
    Mitsuba has it. Values of the image that are not finite fail. Pixels must be
    independent, as they are with a box filter; with a wider one they share samples and vary
    less than their samples' variance says (by half with Mitsuba's Gaussian), so that both
    tests are too lenient.
    """
    a, r = np.asarray(image, np.float64), np.asarray(reference, np.float64)
    v = np.maximum(np.asarray(variance, np.float64), 0.0)
    share = 1 / spp + 1 / reference_spp
    with np.errstate(invalid="ignore"):
        z = np.abs(a - r) / np.sqrt(np.maximum(v, VARIANCE_FLOOR) * share)
    p = np.where(np.isfinite(z), 2 * norm.sf(np.where(np.isfinite(z), z, 0)), 0.0)
    pixels = a.shape[0] * a.shape[1]
    alpha = sidak(SIGNIFICANCE, pixels)
    mean_z = tuple(
        mean_score(a[..., c], r[..., c], v[..., c] * share) for c in range(a.shape[-1])
    )
    smallest = float(2 * norm.sf(max(abs(score) for score in mean_z)))
    return ZTest(
        spp=spp,
        alpha=alpha,
        passing=float(np.mean(p > alpha)),
        smallest_p=float(np.min(p)),
        mean_z=mean_z,
        mean_p=1 - (1 - smallest) ** len(mean_z),
        p_values=p,
    )


def mean_score(
    a: NDArray[np.float64], r: NDArray[np.float64], variance: NDArray[np.float64]
) -> float:
    """How many standard deviations the mean of (H, W) values is above that of the
    reference; ``variance`` is that of the values. Infinite if one is not finite."""
    if not np.all(np.isfinite(a)):
        return math.inf
    excess = float(np.sum(a - r))
    excess -= math.copysign(min(abs(excess), ROUNDING * abs(float(np.sum(r)))), excess)
    deviation = math.sqrt(float(np.sum(variance)))
    if excess == 0:
        return 0.0
    return excess / deviation if deviation > 0 else math.copysign(math.inf, excess)


def sidak(significance: float, tests: int) -> float:
    """Significance of each of several independent tests that have ``significance``
    together."""
    return -math.expm1(math.log1p(-significance) / tests)
