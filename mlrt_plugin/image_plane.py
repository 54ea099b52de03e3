"""The rays of a pinhole camera as an affine map of the film."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .errors import MlrtError
from .scene_arrays import Camera, Film


@dataclass(frozen=True)
class ImagePlane:
    """The ray through the film position (x, y), in pixels of the whole film, is
    {origin + t (base + x dx + y dy)}, where t is the depth along the camera's z.

    As ``cpp/render/camera.h`` has it; (3,) float64 in world space.
    """

    origin: npt.NDArray[np.float64]
    base: npt.NDArray[np.float64]
    dx: npt.NDArray[np.float64]
    dy: npt.NDArray[np.float64]

    def project(
        self, points: npt.ArrayLike
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Film positions (N, 2) of points (N, 3) in world space, and their depths (N,).

        Points that are not in front of the camera have a depth that is not above 0, and a
        position of no meaning.
        """
        to_film = np.linalg.inv(np.stack((self.base, self.dx, self.dy), axis=1))
        depth, x, y = to_film @ (np.asarray(points, np.float64) - self.origin).T
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.stack((x / depth, y / depth), axis=1), depth


def image_plane(camera: Camera, film: Film) -> ImagePlane:
    """The map of a `perspective` camera: x points to the left of the picture, y up, and the
    field of view spans the width of the film (Mitsuba's perspective.cpp). Raises MlrtError
    for another camera."""
    if camera.type != "perspective":
        raise MlrtError(
            f"the rays of a camera of type '{camera.type}' have no common origin: choose a "
            "sensor of type 'perspective'"
        )
    x_axis, y_axis, z_axis = np.array(camera.axes, np.float64)
    tan_x = camera.tan_half_fov_x
    tan_y = tan_x * film.height / film.width
    shift_x, shift_y = (1 - 2 * offset for offset in camera.principal_point_offset)
    return ImagePlane(
        origin=np.array(camera.origin, np.float64),
        base=z_axis + shift_x * tan_x * x_axis + shift_y * tan_y * y_axis,
        dx=-2 * tan_x / film.width * x_axis,
        dy=-2 * tan_y / film.height * y_axis,
    )
