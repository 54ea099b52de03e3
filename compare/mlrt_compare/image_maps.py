"""Maps of where two images differ, as PNG."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray
from PIL import Image as Pillow

from mlrt_files import put_in_place

from .image_pair import ImagePair

DECADES = 6
"""Of the difference, over which the map goes from black to white; chosen."""
NOT_FINITE = (255, 0, 255)

Rgb8 = NDArray[np.uint8]


def write_maps(pairs: Sequence[ImagePair], folder: Path) -> list[Path]:
    """Writes STEM-difference.png, STEM-flip.png if there is FLIP, and STEM-p.png if there
    is a z-test; returns their paths. All are written, or none."""
    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".mlrt-compare-") as temporary:
        names = []
        for pair in pairs:
            for kind, picture in maps_of(pair).items():
                name = f"{pair.image.path.stem}-{kind}.png"
                Pillow.fromarray(picture).save(Path(temporary) / name)
                names.append(name)
        return [put_in_place(Path(temporary) / name, folder / name) for name in names]


def maps_of(pair: ImagePair) -> dict[str, Rgb8]:
    maps = {"difference": difference_map(pair.figures.deviation)}
    if pair.figures.flip is not None:
        maps["flip"] = coloured(pair.figures.flip.error)
    if pair.z_test is not None:
        maps["p"] = p_map(pair.z_test.p_values, pair.z_test.alpha)
    return maps


def difference_map(deviation: NDArray[np.float64]) -> Rgb8:
    """The largest difference of each pixel, logarithmic: white for the image's largest,
    black from a millionth of it down; magenta for what is not finite."""
    finite = np.isfinite(deviation)
    largest = float(np.max(deviation[finite], initial=0.0))
    relative = np.where(finite, deviation, 0) / (largest or 1.0)
    decades = np.log10(np.maximum(relative, 10.0**-DECADES))
    picture = coloured(1 + decades / DECADES)
    picture[~finite] = NOT_FINITE
    return picture


def p_map(p_values: NDArray[np.float64], alpha: float) -> Rgb8:
    """The smallest p-value of each pixel, black for 0 to white for 1; red if it fails."""
    smallest = np.min(p_values, axis=-1)
    grey = np.rint(255 * smallest).astype(np.uint8)
    picture = np.repeat(grey[..., None], 3, axis=-1)
    picture[smallest <= alpha] = (255, 40, 40)
    return picture


def coloured(values: NDArray[np.floating]) -> Rgb8:
    """Values from 0 to 1 in the colours of FLIP's maps."""
    colours = colormaps["magma"](np.clip(values, 0, 1), bytes=True)
    picture: Rgb8 = np.ascontiguousarray(colours[..., :3], np.uint8)
    return picture
