"""How a loaded bitmap texture is looked up, found by asking it.

Mitsuba 3.9 shows the texels of such a texture, and keeps to itself whether its bytes are
sRGB, its filter and its wrap mode. Each is decided at the texel, or between the two texels,
for which the answers differ most; where no answer differs there is nothing to decide.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import drjit as dr
import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects

Values: TypeAlias = npt.NDArray[np.float32]
Ask: TypeAlias = Callable[[float, float], npt.NDArray[np.float64]]
"""Channels of the texture at a column and row, in texels and fractions of them."""
WRAP_MODES = ("repeat", "mirror", "clamp")


def asking(texture: Any, texels: npt.NDArray[Any], to_uv: npt.NDArray[np.float64]) -> Ask:
    """Questions to a loaded texture of texels (H, W, C), with the map `to_uv`, (2, 3)."""
    module = objects.variant_module(texture)
    height, width, channels = texels.shape

    def ask(column: float, row: float) -> npt.NDArray[np.float64]:
        place = np.array([column / width, row / height])
        u, v = np.linalg.solve(to_uv[:, :2], place - to_uv[:, 2])
        surface = module.SurfaceInteraction3f()
        surface.uv = module.Point2f(float(u), float(v))
        return np.asarray(texture.eval(surface), np.float64).reshape(-1)[:channels]

    return ask


def decoded_bytes(ask: Ask, texels: npt.NDArray[np.uint8]) -> Values:
    """What the bytes of an image (H, W, C) stand for: (256,)."""
    linear = (np.arange(256, dtype=np.float32) * np.float32(1 / 255)).astype(np.float32)
    to_linear: Any = dr.srgb_to_linear
    srgb = np.array([float(to_linear(float(v))) for v in linear], np.float32)
    present = np.unique(texels)
    byte = present[np.argmax(linear[present] - srgb[present])]
    row, column, channel = np.unravel_index(int(np.argmax(texels == byte)), texels.shape)
    answer = ask(float(column) + 0.5, float(row) + 0.5)[channel]
    return srgb if abs(answer - srgb[byte]) < abs(answer - linear[byte]) else linear


def is_nearest(ask: Ask, values: Values) -> bool:
    """Whether an image (H, W, C) is not interpolated."""
    sides = [(values[:, :-1], values[:, 1:]), (values[:-1], values[1:])]
    greatest = [float(np.abs(b - a).max()) for a, b in sides]
    axis = int(np.argmax(greatest))
    row, column, channel = most_different(*sides[axis])
    before, after = (float(side[row, column, channel]) for side in sides[axis])
    # A quarter of a texel before the border of the two texels.
    across, down = (0.75, 0.5) if axis == 0 else (0.5, 0.75)
    answer = ask(column + across, row + down)[channel]
    mixed = 0.75 * before + 0.25 * after
    return bool(abs(answer - before) < abs(answer - mixed))


def wrap_mode(ask: Ask, values: Values) -> str:
    """What continues an image (H, W, C) beyond its border."""
    height, width, _ = values.shape
    errors = dict.fromkeys(WRAP_MODES, 0.0)
    for axis in (1, 0):
        last = values.shape[axis] - 1
        continued = {
            "repeat": values,
            "mirror": np.flip(values, axis),
            "clamp": np.broadcast_to(values.take([last], axis), values.shape),
        }
        beyond = (width, 0) if axis == 1 else (0, height)
        for one, other in (("repeat", "mirror"), ("mirror", "clamp"), ("repeat", "clamp")):
            row, column, channel = most_different(continued[one], continued[other])
            answer = ask(column + 0.5 + beyond[0], row + 0.5 + beyond[1])[channel]
            for mode in WRAP_MODES:
                error = abs(answer - float(continued[mode][row, column, channel]))
                errors[mode] = max(errors[mode], error)
    return min(errors, key=errors.__getitem__)


def most_different(one: npt.NDArray[Any], other: npt.NDArray[Any]) -> tuple[int, int, int]:
    """Row, column and channel where two images differ most."""
    place = np.unravel_index(int(np.argmax(np.abs(one - other))), one.shape)
    row, column, channel = (int(index) for index in place)
    return row, column, channel
