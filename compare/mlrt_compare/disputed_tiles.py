"""What a bias is worth that comes from intersections: where two faces are equally near, or
one renderer misses a face, images differ however the light is computed.

If a bias test fails, the tiles that have such pixels, or pixels of samples that rounding
decides, stand apart, and three judges see the
whole image between them: the bias test all other tiles, exact arithmetic the rays that both
sides answer in another way, and equal samples the pixels around those, which must agree to
rounding.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .adjudication import Judgement
from .batch_reference import BatchReference, tile_means
from .bias import BiasTest, bias_test
from .parity import LARGEST_RMSE, parity_and_pixels_apart
from .settings import Settings

SPP = 16
"""Samples a pixel that rays are told apart by; chosen: what fewer than one of 16 samples of
no pixel of a tile meets moves its mean little."""


@dataclass(frozen=True)
class DisputedTiles:
    """What became of a bias test without the tiles of disputed rays."""

    spp: int
    rays: int
    """Of a frame with `spp` samples a pixel."""
    judgement: Judgement
    rmse: float
    """Of the pixels without a disputed ray, of the same samples, over the image's mean."""
    tiles: int
    """That stand apart."""
    others: BiasTest | None
    """Of all other tiles; None if there are none."""

    def reasons(self) -> list[str]:
        """What speaks for a difference all the same, a phrase each."""
        if self.others is None:
            found = ["rays are answered in another way in every tile"]
        else:
            found = self.others.reasons()
        if self.judgement.ours_wrong:
            found.append(f"MLRT answers {self.judgement.ours_wrong} rays wrongly")
        if not self.rmse < LARGEST_RMSE:
            found.append(
                "with the same samples, pixels differ in which all rays are answered alike "
                f"(RMS {self.rmse:.2g} of the mean)"
            )
        return found

    def as_dict(self) -> dict[str, Any]:
        return {
            "spp": self.spp,
            "rays": self.rays,
            "judgement": self.judgement.as_dict(),
            "rmse": self.rmse,
            "tiles": self.tiles,
            "others": self.others.as_dict() if self.others else None,
            "reasons": self.reasons(),
        }


def without_disputes(
    settings: Settings, references: tuple[BatchReference, BatchReference]
) -> DisputedTiles:
    """Takes the same samples by both renderers and tests the bias of the references, ours
    first, without the tiles in which rays hit different things.

    Raises what `parity` does.
    """
    figures, pixels = parity_and_pixels_apart(dataclasses.replace(settings, spp=SPP))
    apart = tile_means(pixels[..., None].astype(np.float64)) > 0
    return DisputedTiles(
        spp=SPP,
        rays=figures.rays,
        judgement=figures.judgement,
        rmse=figures.rmse,
        tiles=int(np.count_nonzero(apart)),
        others=bias_without(apart, *(reference.tiles for reference in references)),
    )


def bias_without(
    apart: NDArray[np.bool_], first: NDArray[np.float64], second: NDArray[np.float64]
) -> BiasTest | None:
    """The bias test of tiles (batches, TH, TW) but for some (TH, TW); None without any."""
    if apart.all():
        return None
    return bias_test(first[:, None, ~apart], second[:, None, ~apart])
