"""All figures of the difference of two EXR images."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .exr_files import ExrImage, colour_of
from .metric_names import METRICS
from .metrics import difference
from .perceptual import Flip, flip, psnr, ssim

SHARE_THRESHOLDS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)
"""Absolute differences, for which the share of pixels beyond is told."""


@dataclass(frozen=True)
class ChannelFigures:
    """One channel; the differences are nan if a value is not finite."""

    name: str
    max_abs: float
    mean_abs: float
    rmse: float
    mean_image: float
    mean_reference: float
    nan: int
    """Values of the image that are nan."""
    infinite: int
    """Values of the image that are infinite."""


@dataclass(frozen=True)
class ImageFigures:
    """Figures of all channels, and those of the colour.

    metrics: by the names in METRICS; None for what cannot be told, nan for what a value
    that is not finite spoils. abs: largest difference; energy: mean of the image over that
    of the reference, minus 1; the others are told where they are computed.
    """

    channels: tuple[ChannelFigures, ...]
    colour: tuple[str, ...]
    metrics: dict[str, float | None]
    deviation: NDArray[np.float64]
    """(H, W) largest absolute difference of a channel; infinite if one is not finite."""
    flip: Flip | None

    @property
    def nonfinite(self) -> int:
        """Pixels with a value that is not finite."""
        return int(np.count_nonzero(np.isinf(self.deviation)))

    def share_beyond(self, threshold: float) -> float:
        """Fraction of the pixels of which a channel differs by more, or is not finite."""
        return float(np.mean(self.deviation > threshold))

    def as_dict(self) -> dict[str, Any]:
        return {
            "channels": [asdict(channel) for channel in self.channels],
            "colour": list(self.colour),
            "metrics": self.metrics,
            "flip_exposures": None if self.flip is None else list(self.flip.exposures),
            "nonfinite_pixels": self.nonfinite,
            "beyond": [
                {"threshold": threshold, "share": self.share_beyond(threshold)}
                for threshold in SHARE_THRESHOLDS
            ],
        }


def image_figures(
    image: ExrImage, reference: ExrImage, names: Sequence[str]
) -> ImageFigures:
    """Figures of the channels ``names``, which both images have; the reference is finite
    in them."""
    channels = tuple(channel_figures(image, reference, name) for name in names)
    a, r = image.stack(names), reference.stack(names)
    finite = np.all(np.isfinite(a), axis=-1)
    deviation = np.where(
        finite, np.max(np.abs(np.where(np.isfinite(a), a, 0) - r), axis=-1), np.inf
    )
    colour = colour_of(names)
    metrics: dict[str, float | None] = dict.fromkeys(METRICS)
    seen: Flip | None = None
    if colour:
        a, r = image.stack(colour), reference.stack(colour)
        if len(colour) == 1:
            a, r = np.repeat(a, 3, axis=-1), np.repeat(r, 3, axis=-1)
        figures = difference(a, r)
        metrics |= {"abs": figures.max_abs, "rmse": figures.rmse}
        metrics |= {"relmse": figures.rel_mse} | linear_metrics(a, r)
        if figures.nonfinite:
            metrics |= dict.fromkeys(("psnr", "ssim", "flip"), float("nan"))
        else:
            seen = flip(a, r)
            metrics |= {"psnr": psnr(a, r), "ssim": ssim(a, r)}
            metrics |= {"flip": None if seen is None else seen.mean}
    return ImageFigures(channels, colour, metrics, deviation, seen)


def channel_figures(image: ExrImage, reference: ExrImage, name: str) -> ChannelFigures:
    a, r = image.channels[name], reference.channels[name]
    finite = np.isfinite(a)
    delta = np.where(finite, np.where(finite, a, 0) - r, np.nan)
    return ChannelFigures(
        name=name,
        max_abs=float(np.max(np.abs(delta))),
        mean_abs=float(np.mean(np.abs(delta))),
        rmse=float(np.sqrt(np.mean(delta**2))),
        mean_image=float(np.mean(np.where(finite, a, np.nan))),
        mean_reference=float(np.mean(r)),
        nan=int(np.count_nonzero(np.isnan(a))),
        infinite=int(np.count_nonzero(np.isinf(a))),
    )


def linear_metrics(
    a: NDArray[np.float64], r: NDArray[np.float64]
) -> dict[str, float | None]:
    """mean_abs; smape, the mean of 2 |a - r| / (|a| + |r|), 0 where both are 0; and energy,
    None for a black reference."""
    a = np.where(np.isfinite(a), a, np.nan)
    delta = np.abs(a - r)
    total = np.abs(a) + np.abs(r)
    symmetric = np.divide(2 * delta, total, out=np.zeros_like(delta), where=total != 0)
    mean = float(np.mean(r))
    return {
        "mean_abs": float(np.mean(delta)),
        "smape": float(np.mean(symmetric)),
        "energy": float(np.mean(a)) / mean - 1 if mean else None,
    }
