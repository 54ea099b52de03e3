"""What of a mesh cannot be traced or shaded, and what is done about it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import SceneError


def check_mesh(vertex_count: int, faces: npt.NDArray[np.uint32], name: str) -> None:
    """Raises SceneError if a mesh has no faces (F, 3), or one with a vertex too high."""
    if not len(faces):
        raise SceneError(
            f"{name} has no faces: its file is truncated, or the shape is not needed"
        )
    largest = int(faces.max())
    if largest >= vertex_count:
        raise SceneError(
            f"{name} has a face that refers to vertex {largest} of {vertex_count}: "
            "repair the mesh"
        )


def drop_not_finite(
    vertices: npt.NDArray[np.float32], faces: npt.NDArray[np.uint32]
) -> int:
    """Takes faces with NaN or infinite vertices out of a mesh, in place.

    vertices: (V, 3); those that are not finite become 0. faces: (F, 3); those that refer to
    them become single points, which no ray hits, so that the others keep their numbers.
    Returns how many that are.
    """
    bad: npt.NDArray[np.bool_] = np.any(~np.isfinite(vertices), axis=1)
    if not bad.any():
        return 0
    dropped = bad[faces].any(axis=1)
    faces[dropped] = faces[dropped, :1]
    vertices[bad] = 0
    return int(np.count_nonzero(dropped))


def repair_normals(
    normals: npt.NDArray[np.float32],
    vertices: npt.NDArray[np.float32],
    faces: npt.NDArray[np.uint32],
) -> int:
    """Replaces vertex normals (V, 3) that give no direction, in place.

    Those are normals that are not finite or of length zero. Each becomes the mean of the
    normals of its faces by area. A vertex of faces without an area, which no ray hits, gets
    an arbitrary unit vector. Returns the number of those that faces with an area use.
    """
    good: npt.NDArray[np.bool_] = np.all(np.isfinite(normals), axis=1)
    bad = ~(good & np.any(normals != 0, axis=1))
    if not bad.any():
        return 0
    around = faces[bad[faces].any(axis=1)]
    corners = vertices.astype(np.float64)[around]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sums = np.zeros(vertices.shape, np.float64)
    np.add.at(sums, around, areas[:, None])
    largest = np.abs(sums[bad]).max(axis=1, keepdims=True)
    # Divided twice: the squares of areas may be out of the range even of double precision.
    unit = np.divide(sums[bad], largest, out=np.zeros_like(sums[bad]), where=largest > 0)
    unit[largest[:, 0] == 0] = (0, 0, 1)
    normals[bad] = unit / np.linalg.norm(unit, axis=1, keepdims=True)
    used = np.zeros(len(vertices), bool)
    used[around[areas.any(axis=1)]] = True
    return int(np.count_nonzero(used & bad))


def warning_about(name: str, dropped: int, face_count: int, normals: int) -> str:
    """A sentence on what was dropped of a mesh and which normals were replaced, or none."""
    parts = []
    if dropped:
        left = "nothing of it is left" if dropped == face_count else "they are left out"
        parts.append(
            f"{dropped} of {face_count} faces with NaN or infinite vertices ({left})"
        )
    if normals:
        parts.append(
            f"{normals} vertex normals that are zero or not finite (the mean normal of the "
            "faces is taken)"
        )
    return f"{name} has {' and '.join(parts)}: repair the mesh" if parts else ""
