"""Copies of solids at many places: how furniture becomes a few large meshes."""

from __future__ import annotations

from collections import defaultdict
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from solids import Meshes

Floats = NDArray[np.float64]
Indices = NDArray[np.int32]


class Mesh(NamedTuple):
    vertices: Floats
    """(n, 3), metres."""
    faces: Indices
    """(m, 3)."""


def prototype(solids: Meshes) -> dict[str, Mesh]:
    """Meshes by material, equal vertices joined."""
    meshes = {}
    for material, faces in solids.faces.items():
        vertices, index = np.unique(
            np.round(solids.vertices[material], 7), axis=0, return_inverse=True
        )
        meshes[material] = Mesh(vertices, index.reshape(-1)[faces].astype(np.int32))
    return meshes


class Places(NamedTuple):
    """Where copies stand; a row for each."""

    feet: Floats
    """(k, 3)."""
    turns: Floats
    """(k,) radians around the vertical."""
    sizes: Floats
    """(k, 3) factors along the axes of the prototype."""


def places(feet: ArrayLike, turns: ArrayLike = 0.0, sizes: ArrayLike = 1.0) -> Places:
    where = np.atleast_2d(np.asarray(feet, dtype=np.float64))
    return Places(
        where,
        np.broadcast_to(np.asarray(turns, dtype=np.float64), len(where)),
        np.broadcast_to(np.asarray(sizes, dtype=np.float64), where.shape),
    )


def within(outer: Places, inner: Places) -> Places:
    """Every place of ``inner`` in the frame of every place of ``outer``, which is not
    stretched; (outer, inner) in row-major order."""
    feet = outer.feet[:, None] + rotated(inner.feet[None], outer.turns[:, None])
    turns = outer.turns[:, None] + inner.turns[None]
    sizes = np.broadcast_to(inner.sizes, feet.shape)
    return Places(feet.reshape(-1, 3), turns.reshape(-1), sizes.reshape(-1, 3))


def rotated(points: Floats, turns: Floats) -> Floats:
    """Points (..., 3) turned by angles (...) around the vertical."""
    c, s = np.cos(turns), np.sin(turns)
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack(np.broadcast_arrays(c * x - s * y, s * x + c * y, z), axis=-1)


class Assembly:
    """Prototypes and their places; no copy is made before its mesh is asked for."""

    def __init__(self) -> None:
        self._copies: dict[str, list[tuple[Mesh, Places]]] = defaultdict(list)
        self.triangles = 0

    def add(self, meshes: dict[str, Mesh], where: Places) -> None:
        for material, mesh in meshes.items():
            self._copies[material].append((mesh, where))
            self.triangles += len(mesh.faces) * len(where.feet)

    def mesh(self, material: str) -> Mesh:
        """All copies of the parts of this material."""
        vertices: list[Floats] = [np.empty((0, 3))]
        faces: list[Indices] = [np.empty((0, 3), np.int32)]
        first = 0
        for mesh, where in self._copies[material]:
            shaped = mesh.vertices[None] * where.sizes[:, None]
            moved = rotated(shaped, where.turns[:, None]) + where.feet[:, None]
            vertices.append(moved.reshape(-1, 3))
            offsets = first + len(mesh.vertices) * np.arange(len(where.feet))
            faces.append(
                (mesh.faces[None] + offsets[:, None, None]).reshape(-1, 3).astype(np.int32)
            )
            first += len(vertices[-1])
        return Mesh(np.concatenate(vertices), np.concatenate(faces))
