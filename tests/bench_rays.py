"""The rays of mlrt-bench, independently of both engines."""

from __future__ import annotations

import numpy as np
import oracles
from mlrt_compare.bench.scenes import BenchScene
from numpy.typing import NDArray


def expected_rays(
    scene: BenchScene, side: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.bool_]]:
    """What becomes of side x side primary rays, by textbook formulas in double: the face
    that each hits or -1, the cosine there or 0, and whether the light is seen from there.
    """
    view = {key: np.asarray(value, np.float64) for key, value in scene.view.items()}
    at = (np.arange(side) + 0.5) / side
    x, y = (axis.ravel() for axis in np.meshgrid(1 - 2 * at, 1 - 2 * at))
    tan = view["tan_half_fov_x"]
    directions = (
        view["axis_z"]
        + np.outer(tan * x, view["axis_x"])
        + np.outer(tan * y, view["axis_y"])
    )
    origins = np.broadcast_to(view["origin"], directions.shape)
    t, face = oracles.double_hits(
        scene.vertices,
        scene.faces,
        origins,
        directions,
        float(view["near_clip"]),
        float(view["far_clip"]),
    )
    hit = face >= 0
    corners = scene.vertices[scene.faces[face]].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    to_hit = origins + np.where(hit, t, 0)[:, None] * directions - view["light"]
    shadow_t, _ = oracles.double_hits(
        scene.vertices,
        scene.faces,
        np.broadcast_to(view["light"], to_hit.shape),
        to_hit,
        1e-4,
        1 - 1e-4,
    )
    lit = hit & np.isinf(shadow_t)
    cosine = np.abs(np.einsum("ij,ij->i", normals, to_hit)) / (
        np.linalg.norm(normals, axis=1) * np.linalg.norm(to_hit, axis=1)
    )
    return face, np.where(hit, cosine, 0), lit
