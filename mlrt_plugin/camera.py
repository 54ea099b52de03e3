"""Camera and film of a loaded scene."""

from __future__ import annotations

import dataclasses
import math
import os
from typing import Any

import numpy as np

from . import mitsuba_objects as objects
from .errors import SceneError, UnsupportedFeature
from .features import FILTERS
from .scene_arrays import Camera, Film

LARGEST_RADIUS = 64
"""Pixels that a reconstruction filter may reach; chosen, far above any in use."""
USUAL_MITCHELL = "B=0.333333, C=0.333333"
"""In the description of a filter with the parameters of the paper."""
BYTES_PER_PIXEL = 64
"""Of colours and AOVs, twice each while they are summed up; measured."""


def read_camera(sensor: Any, name: str) -> Camera:
    """Reads a `perspective` sensor."""
    if objects.plugin_name(sensor) != "perspective":
        raise UnsupportedFeature(f"{name} is not supported: only perspective is so far")
    parts = objects.members(sensor)
    to_world = objects.matrix(sensor.world_transform())
    if not np.isfinite(to_world).all() or abs(np.linalg.det(to_world[:3, :3])) < 1e-6:
        raise SceneError(f"{name} has a singular to_world: repair it")
    fov = objects.number(parts["x_fov"])
    if not 0 < fov < 180:
        raise SceneError(f"{name} has a field of view of {fov:g} degrees: choose 0 to 180")
    axes = to_world[:3, :3] / np.linalg.norm(to_world[:3, :3], axis=0)
    return Camera(
        origin=objects.vec3(to_world[:3, 3]),
        axes=(objects.vec3(axes[:, 0]), objects.vec3(axes[:, 1]), objects.vec3(axes[:, 2])),
        tan_half_fov_x=math.tan(math.radians(fov) / 2),
        near_clip=float(sensor.near_clip()),
        far_clip=float(sensor.far_clip()),
        principal_point_offset=(
            objects.number(parts["principal_point_offset_x"]),
            objects.number(parts["principal_point_offset_y"]),
        ),
    )


def read_film(film: Any, name: str) -> tuple[Film, list[str]]:
    """Reads an `hdrfilm`, and what of it is ignored."""
    if objects.plugin_name(film) != "hdrfilm":
        raise UnsupportedFeature(f"{name} is not supported: only hdrfilm is so far")
    width, height = (int(n) for n in film.size())
    crop_width, crop_height = (int(n) for n in film.crop_size())
    crop_x, crop_y = (int(n) for n in film.crop_offset())
    rfilter = film.rfilter()
    kind = objects.plugin_name(rfilter)
    if kind not in FILTERS:
        raise UnsupportedFeature(
            f"rfilter '{kind}' of {name} is not supported: only {', '.join(FILTERS)} are "
            "so far"
        )
    if kind == "mitchell" and USUAL_MITCHELL not in str(rfilter):
        raise UnsupportedFeature(
            f"rfilter 'mitchell' of {name} is not supported: only its usual parameters B "
            "and C are so far"
        )
    radius = float(rfilter.radius())
    if not 0 < radius <= LARGEST_RADIUS:
        raise SceneError(
            f"rfilter '{kind}' of {name} has a radius of {radius:g} pixels: change it"
        )
    check_size(crop_width, crop_height, name)
    warnings = []
    pixels = objects.described(film, "pixel_format", "rgb")
    if pixels != "rgb":
        warnings.append(f"film: pixel_format '{pixels}' is ignored, the image is RGB")
    return (
        Film(
            width=width,
            height=height,
            crop_x=crop_x,
            crop_y=crop_y,
            crop_width=crop_width,
            crop_height=crop_height,
            filter=kind,
            filter_radius=0.5 if kind == "box" else radius,
            # Mitsuba cuts its Gaussian off at four standard deviations (gaussian.cpp).
            filter_stddev=radius / 4 if kind == "gaussian" else 0.5,
            sample_border=bool(film.sample_border()),
        ),
        warnings,
    )


def check_size(width: int, height: int, name: str) -> None:
    """Raises SceneError for a film, in pixels, that does not fit into memory.

    The system would end the process without a word when the memory is written to.
    """
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if width * height * BYTES_PER_PIXEL > memory:
        raise SceneError(
            f"{name} has {width}x{height} pixels, which is too many for the memory of "
            f"{memory / 2**30:.1f} GiB: reduce it"
        )


def resized(film: Film, resolution: tuple[int, int]) -> Film:
    """The film at another size, in pixels; raises SceneError if it is cropped."""
    size = (film.width, film.height)
    if size == resolution:
        return film
    if (film.crop_width, film.crop_height) != size:
        raise SceneError(
            "the film has a crop window, so its resolution cannot be changed: remove the "
            "crop"
        )
    width, height = resolution
    check_size(width, height, "the film")
    return dataclasses.replace(
        film, width=width, height=height, crop_width=width, crop_height=height
    )
