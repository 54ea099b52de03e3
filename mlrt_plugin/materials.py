"""Materials of a loaded scene as a table of reflectances."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .errors import UnsupportedFeature
from .scene_arrays import Vec3

BLACK: Vec3 = (0.0, 0.0, 0.0)


class MaterialTable:
    """Collects materials; equal ones share a row."""

    def __init__(self) -> None:
        self._rows: dict[tuple[Vec3, Vec3], int] = {}

    def add(self, bsdf: Any, owner: str) -> int:
        """Number of the row of a loaded BSDF; ``owner`` names its shape in messages."""
        row = reflectances(bsdf, owner)
        return self._rows.setdefault(row, len(self._rows))

    def array(self) -> npt.NDArray[np.float32]:
        """(M, 2, 3) linear RGB reflectances, front and back."""
        return np.array(list(self._rows), np.float32).reshape(-1, 2, 3)


def reflectances(bsdf: Any, owner: str) -> tuple[Vec3, Vec3]:
    """Reflectance of the front and of the back of a BSDF.

    Raises UnsupportedFeature unless it is diffuse, or a twosided of diffuse ones, in
    constant colours.
    """
    plugin = objects.plugin_name(bsdf)
    if plugin == "diffuse":
        return objects.color(
            objects.members(bsdf)["reflectance"], f"bsdf of {owner}"
        ), BLACK
    if plugin == "twosided":
        sides = objects.members(bsdf)
        front = reflectances(sides["brdf_0"], owner)[0]
        return front, reflectances(sides.get("brdf_1", sides["brdf_0"]), owner)[0]
    raise UnsupportedFeature(
        f"bsdf '{plugin}' of {owner} is not supported: only diffuse and twosided are so far"
    )
