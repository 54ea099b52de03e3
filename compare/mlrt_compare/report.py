"""What a comparison leaves behind: images of both, a picture of their difference,
figures."""

from __future__ import annotations

from typing import Any

import mitsuba
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow
from PIL import ImageDraw, ImageFont

from .metrics import RELATIVE_TOLERANCE, Image, differing_mask

# Mitsuba's type stubs do not know what depends on the variant.
mi: Any = mitsuba

# Differences are drawn this many times as bright as they are.
AMPLIFICATION = 10.0
LABEL_HEIGHT = 24
MINIMUM_TILE_WIDTH = 256
MARK = np.array([255, 40, 40], np.uint8)

Rgb8 = NDArray[np.uint8]


def to_srgb8(image: Image) -> Rgb8:
    """8-bit sRGB of linear radiance, (H, W, 3); what is not finite becomes magenta."""
    finite = np.all(np.isfinite(image), axis=-1)
    bitmap = mi.Bitmap(np.where(finite[..., None], image, 0).astype(np.float32))
    rgb: Rgb8 = np.array(
        bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True)
    )
    rgb[~finite] = (255, 0, 255)
    return rgb


def signed_difference(image: Image, reference: Image) -> Rgb8:
    """Orange where ``image`` is the brighter one, blue where ``reference`` is, black if
    equal."""
    delta = AMPLIFICATION * np.mean(np.asarray(image, np.float64) - reference, axis=-1)
    orange, blue = np.array([1.0, 0.55, 0.1]), np.array([0.2, 0.55, 1.0])
    strength = np.abs(np.where(np.isfinite(delta), delta, np.nan))[..., None]
    return to_srgb8(np.where(delta[..., None] > 0, orange, blue) * strength)


def marked(image: Image, reference: Image) -> Rgb8:
    """The reference in dim grey, with a red 3 x 3 mark on every pixel that differs."""
    grey = to_srgb8(reference).mean(axis=-1, keepdims=True) * 0.5
    rgb = np.repeat(grey.astype(np.uint8), 3, axis=-1)
    mask = np.pad(differing_mask(image, reference), 1)
    height, width = rgb.shape[:2]
    grown = np.zeros((height, width), bool)
    for y in range(3):
        for x in range(3):
            grown |= mask[y : y + height, x : x + width]
    rgb[grown] = MARK
    return rgb


def side_by_side(image: Image, reference: Image, names: tuple[str, str]) -> Rgb8:
    """Both images, their difference and the pixels that differ, in a row under labels."""
    differing = differing_mask(image, reference)
    tiles = [
        (names[0], to_srgb8(image)),
        (names[1], to_srgb8(reference)),
        (f"difference x {AMPLIFICATION:g}", signed_difference(image, reference)),
        (
            f"{np.count_nonzero(differing)} of {differing.size} differ by > "
            f"{RELATIVE_TOLERANCE:g}",
            marked(image, reference),
        ),
    ]
    return np.concatenate([_labelled(label, tile) for label, tile in tiles], axis=1)


def _labelled(label: str, tile: Rgb8) -> Rgb8:
    """The tile, small ones enlarged by a whole number, under a line of text."""
    factor = -(-MINIMUM_TILE_WIDTH // tile.shape[1])
    enlarged = tile.repeat(factor, axis=0).repeat(factor, axis=1)
    strip = Pillow.new("RGB", (enlarged.shape[1], LABEL_HEIGHT), "white")
    font = ImageFont.load_default(size=14)
    ImageDraw.Draw(strip).text((6, 3), label, fill="black", font=font)
    return np.concatenate([np.asarray(strip), enlarged], axis=0)


def summary(figures: dict[str, Any]) -> str:
    """Figures of :func:`mlrt_compare.run.Comparison.as_dict` as lines of text."""
    lines = [
        f"{figures['scene']}: {figures['width']} x {figures['height']}, "
        f"{figures['spp']} samples a pixel, seed {figures['seed']}, "
        f"{figures['threads']} threads, LLVM {figures['llvm']}",
        f"{'seconds':<34}{'load':>9}{'build':>9}{'first':>9}{'steady':>9}{'JIT':>9}",
    ]
    for side in figures["timings"]:
        lines.append(
            f"  {side['name']:<32}"
            + "".join(
                _seconds(side[key]) for key in ("load", "build", "first", "steady", "jit")
            )
        )
        if side["kernels_from_disk"]:
            lines.append(
                f"  (JIT is short: {side['kernels_from_disk']} kernels of earlier runs "
                "came from Dr.Jit's cache, ~/.drjit)"
            )
    difference = figures["difference"]
    if difference is not None:
        lines.append(
            f"max {_number(difference['max_abs'])}  RMSE {_number(difference['rmse'])}  "
            f"relMSE {_number(difference['rel_mse'])}  "
            f"differing {100 * difference['share']:.4f} % "
            f"({difference['differing']} of {difference['pixels']} pixels)"
        )
    lines.append(figures["verdict"])
    return "\n".join(lines)


def _seconds(value: float | None) -> str:
    return f"{'-' if value is None else f'{value:.3f}':>9}"


def _number(value: float | None) -> str:
    return "not finite" if value is None else f"{value:.3g}"
