"""Meshes of a loaded scene, one after the other in shared arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .errors import SceneError


@dataclass
class Geometry:
    """All faces of a scene; see SceneArrays for the shapes of the arrays."""

    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    normals: npt.NDArray[np.float32]
    first_faces: list[int]
    face_counts: list[int]
    vertex_normals: list[bool]
    flip_normals: list[bool]
    warnings: list[str]


def gather(shapes: list[Any], names: list[str]) -> Geometry:
    """Copies the meshes out of loaded shapes; ``names`` say in messages which is which.

    Raises SceneError for a mesh without faces, with a face that refers to a vertex that
    does not exist, or with a coordinate that is not finite.
    """
    vertices, faces, normals = [], [], []
    interpolated, flipped, first_faces = [], [], []
    warnings: list[str] = []
    vertex_count = face_count = 0
    for shape, name in zip(shapes, names, strict=True):
        points = np.array(shape.vertex_positions_buffer(), np.float32).reshape(-1, 3)
        corners = np.array(shape.faces_buffer(), np.uint32).reshape(-1, 3)
        check_mesh(points, corners, name)
        # A rectangle ignores the normals of its vertices.
        smooth = (
            shape.has_vertex_normals()
            and not shape.has_face_normals()
            and objects.plugin_name(shape) != "rectangle"
        )
        directions = np.zeros_like(points)
        if smooth:
            directions = np.array(shape.vertex_normals_buffer(), np.float32).reshape(-1, 3)
            repaired = repair_normals(directions, points, corners)
            if repaired:
                warnings.append(
                    f"{name} has {repaired} vertex normals that are not finite, as they "
                    "come about beside degenerate faces: the mean normal of the faces is "
                    "taken"
                )
        first_faces.append(face_count)
        vertices.append(points)
        faces.append(corners + np.uint32(vertex_count))
        normals.append(directions)
        interpolated.append(bool(smooth))
        flipped.append(bool(shape.has_flipped_normals()))
        vertex_count += len(points)
        face_count += len(corners)
    if vertex_count > 0xFFFFFFFF:
        raise SceneError(
            f"the scene has {vertex_count} vertices, more than 2**32: split it"
        )
    return Geometry(
        vertices=np.concatenate(vertices),
        faces=np.concatenate(faces),
        normals=np.concatenate(normals)
        if any(interpolated)
        else np.zeros((0, 3), np.float32),
        first_faces=first_faces,
        face_counts=[len(f) for f in faces],
        vertex_normals=interpolated,
        flip_normals=flipped,
        warnings=warnings,
    )


def repair_normals(
    normals: npt.NDArray[np.float32],
    vertices: npt.NDArray[np.float32],
    faces: npt.NDArray[np.uint32],
) -> int:
    """Replaces vertex normals (V, 3) that are not finite, in place; returns their number.

    Each becomes the mean of the normals of its faces by area. A vertex of faces without an
    area, which no ray hits, gets an arbitrary unit vector.
    """
    bad: npt.NDArray[np.bool_] = np.any(~np.isfinite(normals), axis=1)
    count = int(np.count_nonzero(bad))
    if count:
        around = faces[bad[faces].any(axis=1)]
        corners = vertices.astype(np.float64)[around]
        areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sums = np.zeros(vertices.shape, np.float64)
        np.add.at(sums, around, areas[:, None])
        lengths = np.linalg.norm(sums[bad], axis=1, keepdims=True)
        unit = np.divide(sums[bad], lengths, out=np.zeros((count, 3)), where=lengths > 0)
        unit[lengths[:, 0] == 0] = (0, 0, 1)
        normals[bad] = unit
    return count


def check_mesh(
    vertices: npt.NDArray[np.float32], faces: npt.NDArray[np.uint32], name: str
) -> None:
    """Raises SceneError if a mesh, vertices (V, 3) and faces (F, 3), cannot be traced."""
    if not len(faces):
        raise SceneError(
            f"{name} has no faces: its file is truncated, or the shape is not needed"
        )
    bad = int(np.count_nonzero(~np.isfinite(vertices).all(axis=1)))
    if bad:
        raise SceneError(
            f"{name} has {bad} of {len(vertices)} vertices with NaN or infinite "
            "coordinates: "
            "repair the mesh or its to_world"
        )
    largest = int(faces.max())
    if largest >= len(vertices):
        raise SceneError(
            f"{name} has a face that refers to vertex {largest} of {len(vertices)}: "
            "repair the mesh"
        )
