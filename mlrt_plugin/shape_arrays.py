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


@dataclass(frozen=True)
class Specular:
    """A mirror or glass, with the fields of the core's structure of that name in
    ``render/scene.h``."""

    type: str
    reflectance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    transmittance: tuple[float, float, float] = (1.0, 1.0, 1.0)
    reflectance_texture: int = NONE
    transmittance_texture: int = NONE
    eta: tuple[float, float, float] = (0.0, 0.0, 0.0)
    k: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ior: float = 1.0
