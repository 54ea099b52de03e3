"""Camera and film of a loaded scene."""

from __future__ import annotations

import dataclasses
import math
import os
import re
from typing import Any

import numpy as np

from . import mitsuba_objects as objects
from .errors import SceneError, UnsupportedFeature
from .features import FILTERS, SENSORS
from .scene_arrays import Camera, Film

LARGEST_RADIUS = 64
"""Pixels that a reconstruction filter may reach; chosen, far above any in use."""
BYTES_PER_PIXEL = 64
"""Of colours and AOVs, twice each while they are summed up; measured."""


def read_camera(sensor: Any, name: str) -> Camera:
    """Reads a `perspective`, `thinlens` or `orthographic` sensor."""
    plugin = objects.plugin_name(sensor)
    if plugin not in SENSORS:
        raise UnsupportedFeature(
            f"{name} is not supported: only {', '.join(SENSORS)} are so far"
        )
    parts = objects.members(sensor)
    to_world = objects.matrix(sensor.world_transform())
    objects.check_invertible(to_world, name)
    lengths = np.linalg.norm(to_world[:3, :3], axis=0)
    axes = to_world[:3, :3] / lengths
    if not objects.is_orthogonal(to_world):
        raise UnsupportedFeature(
            f"{name} has a to_world that shears, which is not supported: take the shear out"
        )
    near, far = float(sensor.near_clip()), float(sensor.far_clip())
    common: dict[str, Any] = {
        "origin": objects.vec3(to_world[:3, 3]),
        "axes": tuple(objects.vec3(axes[:, k]) for k in range(3)),
        "type": plugin,
        "samples_time": float(sensor.shutter_open_time()) > 0,
    }
    if plugin == "orthographic":
        # Mitsuba scales where rays begin, but not how far they go.
        start = near * float(lengths[2])
        return Camera(
            **common,
            tan_half_fov_x=1.0,
            near_clip=start,
            far_clip=start + (far - near),
            half_extent=(float(lengths[0]), float(lengths[1])),
        )
    fov = objects.number(parts["x_fov"])
    if not 0 < fov < 180:
        raise SceneError(f"{name} has a field of view of {fov:g} degrees: choose 0 to 180")
    common |= {
        "tan_half_fov_x": math.tan(math.radians(fov) / 2),
        "near_clip": near,
        "far_clip": far,
    }
    if plugin == "thinlens":
        radius, focus = (
            objects.number(parts[part]) for part in ("aperture_radius", "focus_distance")
        )
        for what, value in (("aperture_radius", radius), ("focus_distance", focus)):
            if not (value > 0 and math.isfinite(value)):
                raise SceneError(f"{name} has {what} = {value:g}: it must be positive")
        return Camera(**common, aperture_radius=radius, focus_distance=focus)
    offset_x, offset_y = (
        objects.number(parts[f"principal_point_offset_{axis}"]) for axis in "xy"
    )
    return Camera(**common, principal_point_offset=(offset_x, offset_y))


def camera_warnings(camera: Camera, name: str) -> list[str]:
    """What of a sensor is taken in another way, a sentence each."""
    # Mitsuba takes this in place of 0 (thinlens.cpp).
    if camera.type == "thinlens" and camera.aperture_radius <= np.finfo(np.float32).eps:
        return [
            f"{name} has aperture_radius = 0: it is a pinhole, which type 'perspective' "
            "renders faster"
        ]
    return []


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
            **(mitchell_parameters(rfilter) if kind == "mitchell" else {}),
        ),
        warnings,
    )


def mitchell_parameters(rfilter: Any) -> dict[str, float]:
    """B and C of a filter, which its description alone tells, with six digits; a third,
    the usual value, is taken to be one."""
    shown = {
        name: float(value)
        for name, value in re.findall(r"\b([BC])=([^\s,\]]+)", str(rfilter))
    }
    return {
        f"filter_{name.lower()}": 1 / 3 if value == 0.333333 else value
        for name, value in shown.items()
    }


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
