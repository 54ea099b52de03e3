"""Shapes of a scene as plain data: runs of faces."""

from __future__ import annotations

from dataclasses import dataclass

NONE = 0xFFFFFFFF
"""Marks the absence of a material, emitter or shape."""


@dataclass(frozen=True)
class Shape:
    """A run of faces that share a material and an emitter."""

    first_face: int
    face_count: int
    material: int = NONE
    emitter: int = NONE
    vertex_normals: bool = False
    flip_normals: bool = False
    texture_coordinates: bool = False
