"""References that know their own noise: the mean of many renders with other seeds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .reference_cache import ReferenceCache
from .renderers import Renderer
from .seeds import spread_seeds

TILE = 16
"""Pixels along a side of the tiles whose means are kept of each batch; chosen so that a
tile's mean is nearly normally distributed."""


@dataclass(frozen=True)
class BatchReference:
    """The mean of independent renders of one renderer."""

    mean: NDArray[np.float64]
    """(H, W, 3) of linear radiance."""
    variance: NDArray[np.float64]
    """(H, W, 3), of the mean, from the spread of the batches."""
    tiles: NDArray[np.float64]
    """(batches, TH, TW) mean over pixels and channels of a tile."""
    spp: int
    """Of all batches together."""

    @property
    def mse(self) -> float:
        """Expected mean square of the reference's own error."""
        return float(np.mean(self.variance))


def batch_reference(
    renderer: Renderer,
    key: tuple[object, ...],
    cache: ReferenceCache,
    *,
    batches: int,
    spp: int,
    seed: int,
    progress: Callable[[], object] = lambda: None,
) -> BatchReference:
    """Renders ``batches`` images of ``spp`` samples a pixel each, or takes the cache's.

    key: what the images depend on besides. seed: where the batches' seeds start.
    progress: called after each batch.
    """
    path = cache.path("batches", *key, batches, spp, seed, TILE)
    arrays = cache.load(path)
    if arrays is None or set(arrays) != {"mean", "variance", "tiles"}:
        arrays = _rendered(renderer, batches, spp, seed, progress)
        cache.store(path, arrays)
    return BatchReference(**arrays, spp=batches * spp)


def _rendered(
    renderer: Renderer,
    batches: int,
    spp: int,
    seed: int,
    progress: Callable[[], object],
) -> dict[str, NDArray[np.float64]]:
    tiles = []
    for number, batch_seed in enumerate(spread_seeds(seed, batches)):
        renderer.frame(spp=spp, seed=batch_seed)
        image = renderer.image.astype(np.float64)
        tiles.append(tile_means(image))
        # Welford's update: the sum of squares about the mean suffers no cancellation.
        if number == 0:
            mean, squares = image, np.zeros_like(image)
        else:
            delta = image - mean
            mean = mean + delta / (number + 1)
            squares += delta * (image - mean)
        progress()
    variance = squares / ((batches - 1) * batches)
    return {"mean": mean, "variance": variance, "tiles": np.stack(tiles)}


def tile_means(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means over pixels and channels of tiles of 16 x 16 pixels, smaller ones at the right
    and lower margin: (TH, TW) of (H, W, C)."""
    gray = np.mean(image, axis=-1)
    rows, columns = np.arange(0, gray.shape[0], TILE), np.arange(0, gray.shape[1], TILE)
    sums = np.add.reduceat(np.add.reduceat(gray, rows, axis=0), columns, axis=1)
    heights = np.diff(np.append(rows, gray.shape[0]))
    widths = np.diff(np.append(columns, gray.shape[1]))
    return np.asarray(sums / np.outer(heights, widths))
