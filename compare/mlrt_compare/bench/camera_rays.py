"""Rays of a camera as arrays, and the orders that they may come in."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from mlrt_plugin.scene_arrays import Camera


@dataclass(frozen=True)
class Rays:
    """Rays from one point.

    origin: (3,); directions: (N, 3); t_min, t_max: (N,); all float32, in scene units.
    """

    origin: npt.NDArray[np.float32]
    directions: npt.NDArray[np.float32]
    t_min: npt.NDArray[np.float32]
    t_max: npt.NDArray[np.float32]

    def ordered(self, order: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.float32], ...]:
        """Arguments of a query of the native core."""
        origins = np.ascontiguousarray(np.broadcast_to(self.origin, (len(order), 3)))
        return (
            origins,
            np.ascontiguousarray(self.directions[order]),
            np.ascontiguousarray(self.t_min[order]),
            np.ascontiguousarray(self.t_max[order]),
        )


def camera_rays(camera: Camera, side: int) -> Rays:
    """Through the centres of the pixels of a square film, row by row (Mitsuba's
    perspective.cpp: x points to the left)."""
    x_axis, y_axis, z_axis = np.array(camera.axes, np.float64)
    place = 1 - 2 * (np.arange(side) + 0.5) / side
    x = (place - 2 * camera.principal_point_offset[0]) * camera.tan_half_fov_x
    y = (place - 2 * camera.principal_point_offset[1]) * camera.tan_half_fov_x
    directions = z_axis + x[None, :, None] * x_axis + y[:, None, None] * y_axis
    count = side * side
    return Rays(
        np.array(camera.origin, np.float32),
        directions.reshape(count, 3).astype(np.float32),
        np.full(count, camera.near_clip, np.float32),
        np.full(count, camera.far_clip, np.float32),
    )


def morton_order(side: int) -> npt.NDArray[np.int64]:
    """Numbers of the pixels of a square film, row by row, in Morton order."""
    row, column = np.divmod(np.arange(side * side, dtype=np.int64), side)
    code = np.zeros_like(row)
    for bit in range(16):
        code |= (column >> bit & 1) << 2 * bit | (row >> bit & 1) << 2 * bit + 1
    return np.argsort(code, kind="stable")
