"""Analytic shapes and instances of a scene as plain data: what is not in its tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .shape_arrays import Shape

ANALYTIC_TYPES = ("sphere", "disk", "cylinder")
"""In the order of `AnalyticType` of the core's ``geometry/analytic_shape.h``."""


@dataclass(frozen=True)
class GroupArrays:
    """A shapegroup: its meshes, in its own frame, and how many analytic shapes it has.

    vertices: (V, 3) float32. faces: (F, 3) uint32. normals: (V, 3) float32, or (0, 3) if no
    shape interpolates vertex normals. uvs: (V, 2) float32, or (0, 2) if nothing needs any.
    """

    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    normals: npt.NDArray[np.float32]
    uvs: npt.NDArray[np.float32]
    analytic_count: int


@dataclass(frozen=True)
class ObjectArrays:
    """What rays meet beside the tree.

    shapes: the meshes of the groups, then the analytic shapes of the scene, then those of
    the groups; an analytic shape has one face. They follow those of `SceneArrays`, and so
    do the numbers of their faces. shape_names: what messages call them.
    analytic_types: (A,) uint32, places in ANALYTIC_TYPES. analytic_frames: (A, 3, 4)
    float64, from the frame of the shape, where its size is one, to the scene or its group.
    scene_analytic_count: how many of them, the first, are in no group.
    instance_groups: (I,) uint32, numbers of groups. instance_maps: (I, 3, 4) float64, from
    the group to the world. instance_normals: (I, 3, 3) float64, the same for normals.
    """

    shapes: tuple[Shape, ...]
    shape_names: tuple[str, ...]
    analytic_types: npt.NDArray[np.uint32]
    analytic_frames: npt.NDArray[np.float64]
    scene_analytic_count: int
    groups: tuple[GroupArrays, ...]
    instance_groups: npt.NDArray[np.uint32]
    instance_maps: npt.NDArray[np.float64]
    instance_normals: npt.NDArray[np.float64]
