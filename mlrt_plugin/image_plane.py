"""The rays of a pinhole camera as an affine map of the film."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .errors import MlrtError
from .scene_arrays import Camera, Film


@dataclass(frozen=True)
class ImagePlane:
    """The ray through the film position (x, y), in pixels of the whole film, is
    {origin + t (base + x dx + y dy)}, where t is the depth along the camera's z.

    (3,) float64 in world space, from ``cpp/render/camera.h``.
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
    """The map of a `perspective` camera, by the native core. Raises MlrtError for another
    camera."""
    if camera.type != "perspective":
        raise MlrtError(
            f"the rays of a camera of type '{camera.type}' have no common origin: choose a "
            "sensor of type 'perspective'"
        )
    plane = core.image_plane(dataclasses.asdict(camera), dataclasses.asdict(film))
    return ImagePlane(**{name: np.array(vector) for name, vector in plane.items()})
