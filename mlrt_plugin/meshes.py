"""Meshes of a loaded scene, one after the other in shared arrays."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .errors import SceneError
from .mesh_repair import check_mesh, drop_not_finite, repair_normals, warning_about


@dataclass
class Geometry:
    """All faces of a scene; see SceneArrays for the shapes of the arrays.

    dropped: the number of faces of each shape that have a vertex that is not finite.
    """

    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    normals: npt.NDArray[np.float32]
    first_faces: list[int]
    first_vertices: list[int]
    face_counts: list[int]
    vertex_normals: list[bool]
    flip_normals: list[bool]
    dropped: list[int]
    warnings: list[str]


def gather(shapes: list[Any], names: list[str]) -> Geometry:
    """Copies the meshes out of loaded shapes; ``names`` say in messages which is which.

    Faces with a vertex that is not finite are made points, which no ray hits. Raises
    SceneError for a mesh without faces, for one with a face that refers to a vertex that
    does not exist, and for a light that has nothing to glow on.
    """
    vertices, faces, normals = [], [], []
    interpolated, flipped, first_faces, not_finite = [], [], [], []
    first_vertices = []
    warnings: list[str] = []
    vertex_count = face_count = 0
    for shape, name in zip(shapes, names, strict=True):
        points = np.array(shape.vertex_positions_buffer(), np.float32).reshape(-1, 3)
        corners = np.array(shape.faces_buffer(), np.uint32).reshape(-1, 3)
        check_mesh(len(points), corners, name)
        dropped = drop_not_finite(points, corners)
        if dropped and objects.plugin_name(shape) in ("rectangle", "cube"):
            raise SceneError(
                f"{name} has a to_world with NaN or infinite entries: repair it"
            )
        if shape.emitter() is not None and not has_area(points, corners):
            raise SceneError(
                f"{name} glows, but its area is zero or infinite in single precision: "
                "repair the mesh, or scale the scene"
            )
        # Those of a rectangle are that of its faces, unless it is mirrored.
        smooth = (
            shape.has_vertex_normals()
            and not shape.has_face_normals()
            and (objects.plugin_name(shape) != "rectangle" or is_mirrored(shape))
        )
        directions = np.zeros_like(points)
        repaired = 0
        if smooth:
            directions = np.array(shape.vertex_normals_buffer(), np.float32).reshape(-1, 3)
            repaired = repair_normals(directions, points, corners)
        warning = warning_about(name, dropped, len(corners), repaired)
        if warning:
            warnings.append(warning)
        not_finite.append(dropped)
        first_faces.append(face_count)
        first_vertices.append(vertex_count)
        vertices.append(points)
        faces.append(corners + np.uint32(vertex_count))
        normals.append(directions)
        interpolated.append(bool(smooth))
        flipped.append(bool(shape.has_flipped_normals()))
        vertex_count += len(points)
        face_count += len(corners)
    if not shapes:
        vertices = normals = [np.zeros((0, 3), np.float32)]
        faces = [np.zeros((0, 3), np.uint32)]
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
        first_vertices=first_vertices,
        face_counts=[len(f) for f in faces] if shapes else [],
        vertex_normals=interpolated,
        flip_normals=flipped,
        dropped=not_finite,
        warnings=warnings,
    )


def is_mirrored(rectangle: Any) -> bool:
    """Whether the normals of a rectangle's vertices point to the back of its faces, as
    those of a to_world that mirrors do: Mitsuba shades by the former."""
    points = np.array(rectangle.vertex_positions_buffer(), np.float64).reshape(-1, 3)
    normals = np.array(rectangle.vertex_normals_buffer(), np.float64).reshape(-1, 3)
    along_u, along_v = points[1] - points[0], points[2] - points[0]
    with np.errstate(invalid="ignore", over="ignore"):
        return bool(np.cross(along_u, along_v) @ normals[0] < 0)


def rectangle_corners(geometry: Geometry, shapes: list[Any], number: int) -> Any:
    """(4, 3) vertices of a mesh if it is a rectangle, else None."""
    if number >= len(shapes) or objects.plugin_name(shapes[number]) != "rectangle":
        return None
    first = geometry.first_faces[number]
    indices = np.unique(geometry.faces[first : first + geometry.face_counts[number]])
    return geometry.vertices[indices]


def has_area(vertices: npt.NDArray[np.float32], faces: npt.NDArray[np.uint32]) -> bool:
    """Whether the area of a mesh is positive and finite, as lights need it."""
    with np.errstate(over="ignore", invalid="ignore"):
        a, b, c = (vertices[faces[:, i]] for i in range(3))
        products = np.cross(b - a, c - a)
        area = float(np.sqrt((products * products).sum(axis=1)).sum())
    return 0 < area < np.inf
