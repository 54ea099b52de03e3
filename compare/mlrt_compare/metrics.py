"""Differences of two linear images, in numbers.

Everything is computed in float64. ``image`` is what is judged, ``reference`` what it is
held against; both are (H, W, C) arrays of linear radiance.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# A pixel differs if a channel differs by more than this, relatively to the larger of the
# two.
RELATIVE_TOLERANCE = 1e-3

# Differences below this fraction of the reference's mean are no differences: the cosine of
# a grazing ray is a sum of products near one, so float32 leaves some 2^-22 = 2.4e-7 of the
# full brightness in it, however dark the pixel is. Being relative to the mean, it does not
# depend on the exposure.
FLOOR_OF_MEAN = 1e-6

# Keeps relMSE finite in the dark; the customary value for radiance of about one.
REL_MSE_EPSILON = 1e-2

Image = NDArray[Any]


class SizeMismatch(ValueError):
    """The two images have different shapes, so no figure can be given."""


@dataclass(frozen=True)
class Difference:
    """Figures of one comparison; nan where a value of either image is not finite."""

    max_abs: float
    """Largest difference of a channel, in units of radiance."""
    rmse: float
    """Root of the mean square over pixels and channels, in units of radiance."""
    rel_mse: float
    """Mean of (image - reference)^2 / (reference^2 + 1e-2)."""
    differing: int
    """Pixels of which a channel differs by more than 1e-3 relatively, or is not finite."""
    nonfinite: int
    """Pixels with a nan or an infinity in either image."""
    pixels: int

    @property
    def share(self) -> float:
        """Fraction of the pixels that differ."""
        return self.differing / self.pixels

    def as_dict(self) -> dict[str, float | int]:
        return {**asdict(self), "share": self.share}


def difference(image: Image, reference: Image) -> Difference:
    """Figures for two images of shape (H, W, C).

    Values that are not finite are never averaged away: they make every mean nan, and their
    pixels count as differing. Raises SizeMismatch if the shapes differ, ValueError if there
    is no pixel.
    """
    a, r = _pair(image, reference)
    nonfinite = _nonfinite(a, r)
    with np.errstate(invalid="ignore", over="ignore"):
        delta = np.where(nonfinite[..., None], np.nan, a - r)
        square = delta**2
        rel_mse = np.mean(square / (r**2 + REL_MSE_EPSILON))
    return Difference(
        max_abs=float(np.max(np.abs(delta))),
        rmse=float(np.sqrt(np.mean(square))),
        rel_mse=float(rel_mse),
        differing=int(np.count_nonzero(_differing(a, r, nonfinite))),
        nonfinite=int(np.count_nonzero(nonfinite)),
        pixels=nonfinite.size,
    )


def differing_mask(image: Image, reference: Image) -> NDArray[np.bool_]:
    """(H, W) mask of the pixels that :func:`difference` counts as differing.

    A pixel differs if in any channel |a - r| > 1e-3 max(|a|, |r|) and |a - r| > 1e-6
    mean|r|, or if a value is not finite. Raises as :func:`difference` does.
    """
    a, r = _pair(image, reference)
    return _differing(a, r, _nonfinite(a, r))


def _pair(
    image: Image, reference: Image
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, r = np.asarray(image, np.float64), np.asarray(reference, np.float64)
    if a.shape != r.shape:
        raise SizeMismatch(f"the images have different shapes: {a.shape} and {r.shape}")
    if a.ndim != 3 or a.size == 0:
        raise ValueError(
            f"an image must have shape (H, W, C) with no zero in it, not {a.shape}"
        )
    return a, r


def _nonfinite(a: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(~np.all(np.isfinite(a) & np.isfinite(r), axis=-1), np.bool_)


def _differing(
    a: NDArray[np.float64], r: NDArray[np.float64], nonfinite: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    finite = np.abs(r[np.isfinite(r)])
    floor = FLOOR_OF_MEAN * float(np.mean(finite)) if finite.size else 0.0
    with np.errstate(invalid="ignore"):
        delta = np.abs(a - r)
        larger = np.maximum(np.abs(a), np.abs(r))
        channels = (delta > RELATIVE_TOLERANCE * larger) & (delta > floor)
    return np.asarray(nonfinite | np.any(channels, axis=-1), np.bool_)
