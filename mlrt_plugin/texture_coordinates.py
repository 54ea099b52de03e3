"""Texture coordinates of the meshes of a loaded scene, of those that need them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import SceneError


@dataclass
class TextureCoordinates:
    """uvs: (V, 2) float32, zero where a shape has or needs none; (0, 2) if none does.
    present: which shapes have them. warnings: a sentence each."""

    uvs: npt.NDArray[np.float32]
    present: list[bool]
    warnings: list[str]


def gather_coordinates(
    shapes: list[Any],
    names: list[str],
    needed: list[bool],
    first_vertices: list[int],
    all_that_are: bool = False,
) -> TextureCoordinates:
    """Copies them out of loaded shapes; `needed` says of which.

    all_that_are: also of those that can do without, for the frames that BSDF samples are
    taken in. Raises SceneError for a mesh that needs them and has some that are not finite.
    """
    present = [
        bool(
            shape.has_vertex_texcoords()
            and (need or (all_that_are and np.isfinite(coordinates_of(shape)).all()))
        )
        for shape, need in zip(shapes, needed, strict=True)
    ]
    warnings = [
        f"{name} has no texture coordinates, so each of its faces shows the texture anew, "
        "as in Mitsuba: give it some"
        for name, need, has in zip(names, needed, present, strict=True)
        if need and not has
    ]
    if not any(present):
        return TextureCoordinates(np.zeros((0, 2), np.float32), present, warnings)
    last = first_vertices[-1] + int(shapes[-1].vertex_count())
    uvs = np.zeros((last, 2), np.float32)
    for shape, name, has, first in zip(shapes, names, present, first_vertices, strict=True):
        if not has:
            continue
        own = coordinates_of(shape)
        broken = int(np.count_nonzero(~np.isfinite(own).all(axis=1)))
        if broken:
            raise SceneError(
                f"{name} has {broken} vertices with NaN or infinite texture coordinates: "
                "repair the mesh"
            )
        uvs[first : first + len(own)] = own
    return TextureCoordinates(uvs, present, warnings)


def coordinates_of(shape: Any) -> npt.NDArray[np.float32]:
    """(V, 2) of a shape that has some."""
    return np.array(shape.vertex_texcoords_buffer(), np.float32).reshape(-1, 2)
