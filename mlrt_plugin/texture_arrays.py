"""Textures of a scene as plain, immutable data.

The classes are the kinds of the structure `Texture` in the native core's
``render/texture.h``, with the names of its fields. Textures refer to others by their
numbers in the scene's list.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Row = tuple[float, float, float]
"""Of a map from (u, v, 1)."""


@dataclass(frozen=True)
class ConstantTexture:
    """A linear RGB colour."""

    colour: Row
    type: str = "constant"


@dataclass(frozen=True)
class CheckerboardTexture:
    """Squares with two textures of lower numbers, after the map `to_u`, `to_v`."""

    square_0: int
    square_1: int
    to_u: Row
    to_v: Row
    type: str = "checkerboard"


@dataclass(frozen=True, eq=False)
class BitmapTexture:
    """An image.

    texels: (height, width, channels) float32, linear, or uint8, numbers of entries of
    `decoded`, (256,) float32, which is None for float32. channels: 1 or 3.
    """

    width: int
    height: int
    channels: int
    nearest: bool
    wrap: str
    to_u: Row
    to_v: Row
    texels: npt.NDArray[Any]
    decoded: npt.NDArray[np.float32] | None
    type: str = "bitmap"


@dataclass(frozen=True, eq=False)
class AttributeTexture:
    """Values of a mesh's vertices or faces; `type` says of which.

    first: the number in the scene of the first vertex or face. texels: (N, channels)
    float32. channels: 1 or 3.
    """

    type: str
    first: int
    channels: int
    texels: npt.NDArray[np.float32]
    decoded: None = None


Texture: TypeAlias = (
    ConstantTexture | CheckerboardTexture | BitmapTexture | AttributeTexture
)


def fields_of(texture: Texture) -> dict[str, Any]:
    """What the native core takes, without copies of arrays."""
    return dict(vars(texture))
