"""Differences as eyes see them: PSNR, SSIM and FLIP of two linear images.

``image`` and ``reference`` are finite (H, W, 3) arrays of linear radiance with the
primaries of sRGB. PSNR and SSIM are taken of displayed values: those that fill the range
of sRGB when the reference's bright parts do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import flip_evaluator
import numpy as np
from numpy.typing import NDArray
from skimage import metrics as skimage_metrics

from .metrics import Image

structural_similarity: Any = skimage_metrics.structural_similarity

WHITE_PERCENTILE = 99.0
"""Of the reference's largest channels: this one is displayed as white; chosen."""
SSIM_SIGMA = 1.5
"""Of the Gaussian window, in pixels (Wang, Bovik, Sheikh and Simoncelli 2004)."""
SSIM_SIDE = 11
"""Side of that window; smaller images have no SSIM."""


@dataclass(frozen=True)
class Flip:
    """HDR-FLIP of two images (Andersson et al. 2021)."""

    mean: float
    """0 if they look the same, at most 1."""
    error: NDArray[np.float32]
    """(H, W) from 0 to 1, the largest over the exposures."""
    exposures: tuple[float, float]
    """The least and the greatest, in stops."""


def displayed(image: Image, reference: Image) -> NDArray[np.float64]:
    """Values from 0 to 1 in the curve of sRGB, exposed for the reference."""
    linear = np.clip(np.asarray(image, np.float64) / white(reference), 0.0, 1.0)
    curved = 1.055 * linear ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curved)


def white(reference: Image) -> float:
    """The radiance that is displayed as white; 1 if the reference is black."""
    largest = np.max(np.asarray(reference, np.float64), axis=-1)
    found = float(np.percentile(largest, WHITE_PERCENTILE))
    if found <= 0:
        found = float(np.max(largest))
    return found if found > 0 else 1.0


def psnr(image: Image, reference: Image) -> float:
    """Peak signal-to-noise ratio in dB of displayed values; infinite if they are equal."""
    difference = displayed(image, reference) - displayed(reference, reference)
    mse = float(np.mean(difference**2))
    return -10.0 * math.log10(mse) if mse > 0 else math.inf


def ssim(image: Image, reference: Image) -> float | None:
    """Mean structural similarity of displayed values; None below 11 pixels a side."""
    if min(np.shape(reference)[:2]) < SSIM_SIDE:
        return None
    return float(
        structural_similarity(
            displayed(image, reference),
            displayed(reference, reference),
            channel_axis=-1,
            data_range=1.0,
            gaussian_weights=True,
            sigma=SSIM_SIGMA,
            use_sample_covariance=False,
        )
    )


def flip(image: Image, reference: Image) -> Flip | None:
    """HDR-FLIP with its usual viewing distance and exposures; None for a black reference.

    Negative values count as black.
    """
    largest = float(np.max(reference))
    if not largest > 0:
        return None

    # FLIP has an absolute threshold of darkness, below which it ends the process.
    def scaled(values: Image) -> NDArray[np.float32]:
        limited = np.minimum(np.maximum(values, 0) / largest, 1e30)
        return np.ascontiguousarray(limited, np.float32)

    error, mean, used = flip_evaluator.evaluate(
        scaled(reference), scaled(image), "HDR", applyMagma=False
    )
    shift = math.log2(largest)
    return Flip(
        float(mean),
        np.asarray(error, np.float32)[..., 0],
        (used["startExposure"] - shift, used["stopExposure"] - shift),
    )
