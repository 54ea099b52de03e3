"""Verdicts on figures, in the manner of OpenImageIO's idiff.

A pixel is beyond a threshold if a channel differs by more, or is not finite. Too many of
them, a single one beyond a hard threshold, and a figure beyond its limit warn or fail.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from .image_figures import ImageFigures
from .metric_names import BETTER_LARGER
from .options import FAILED, PASSED, WARNED

IDIFF_THRESHOLD = 1e-6


@dataclass(frozen=True)
class Limits:
    """When a comparison warns, or when it fails."""

    threshold: float = IDIFF_THRESHOLD
    """Absolute difference of a channel that few pixels may exceed."""
    percent: float = 0.0
    """How many may."""
    hard: float = math.inf
    """Absolute difference that no pixel may exceed."""
    metrics: dict[str, float] = field(default_factory=dict)
    """The greatest value of a metric, or the least of one that is better the larger it
    is."""

    def reasons(self, figures: ImageFigures) -> list[str]:
        """What is beyond the limits, a phrase each."""
        found = []
        share = 100 * figures.share_beyond(self.threshold)
        if share > self.percent:
            found.append(
                f"{share:.4g} % of the pixels differ by more than {self.threshold:g}, at "
                f"most {self.percent:g} % may"
            )
        largest = float(figures.deviation.max())
        if largest > self.hard:
            found.append(f"a pixel differs by {largest:.4g}, at most {self.hard:g} may be")
        for name, limit in self.metrics.items():
            value = figures.metrics[name]
            if value is None or math.isnan(value):
                found.append(f"{name} cannot be told, so it cannot keep to {limit:g}")
            elif name in BETTER_LARGER and value < limit:
                found.append(f"{name} is {value:.6g}, at least {limit:g} is asked for")
            elif name not in BETTER_LARGER and abs(value) > limit:
                found.append(f"{name} is {value:.6g}, at most {limit:g} may be")
        return found


@dataclass(frozen=True)
class ImageVerdict:
    """The exit code, and why."""

    failures: tuple[str, ...]
    warnings: tuple[str, ...]

    @property
    def code(self) -> int:
        return FAILED if self.failures else WARNED if self.warnings else PASSED

    @property
    def word(self) -> str:
        return {PASSED: "PASS", WARNED: "WARNING", FAILED: "FAIL"}[self.code]

    def __str__(self) -> str:
        reasons = self.failures or self.warnings
        return self.word + (": " + "; ".join(reasons) if reasons else "")


def judge_figures(
    figures: ImageFigures, failing: Limits, warning: Limits, others: list[str]
) -> ImageVerdict:
    """The verdict on figures; ``others`` are further reasons to fail.

    Values of the image that are not finite always fail it.
    """
    failures = failing.reasons(figures) + others
    if figures.nonfinite:
        failures.insert(0, f"{figures.nonfinite} pixels of the image are not finite")
    return ImageVerdict(tuple(failures), tuple(warning.reasons(figures)))
