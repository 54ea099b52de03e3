"""The verdict on a rendered image: does it agree with Mitsuba's?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .metrics import Difference, Image, SizeMismatch, difference

# Edges and shadow borders may differ, where one image is watertight and the other is not,
# or where rounding decides; nothing else may.
MAXIMUM_SHARE = 1e-3


@dataclass(frozen=True)
class Verdict:
    """Whether two images agree, and if not every reason why."""

    reasons: tuple[str, ...]
    difference: Difference | None
    """None if the images have different sizes."""

    @property
    def passed(self) -> bool:
        return not self.reasons

    def __str__(self) -> str:
        return "PASS" if self.passed else "FAIL: " + "; ".join(self.reasons)


def judge(
    image: Image, reference: Image, *, maximum_share: float = MAXIMUM_SHARE
) -> Verdict:
    """Holds ``image`` against ``reference``, both (H, W, C) of linear radiance.

    Passes if at most ``maximum_share`` of the pixels differ by more than 1e-3 relatively,
    every value is finite and neither image is black all over.
    """
    try:
        figures = difference(image, reference)
    except SizeMismatch as error:
        return Verdict((str(error),), None)
    reasons = []
    for name, values in (("image", image), ("reference", reference)):
        broken = np.count_nonzero(~np.all(np.isfinite(values), axis=-1))
        if broken:
            reasons.append(f"{broken} pixels of the {name} are not finite")
        if not np.any(values):
            reasons.append(f"the {name} is black all over")
    if figures.share > maximum_share:
        reasons.append(
            f"{100 * figures.share:.4f} % of the pixels differ, at most "
            f"{100 * maximum_share:g} % may"
        )
    return Verdict(tuple(reasons), figures)
