"""Light sources of a loaded scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .errors import SceneError, UnsupportedFeature
from .scene_arrays import Emitter, Vec3


def read_emitter(
    emitter: Any,
    name: str,
    shape: int,
    corners: npt.NDArray[np.float32] | None,
) -> Emitter:
    """Reads one emitter.

    shape: number of the shape that glows, for an area light.
    corners: (4, 3) vertices of that shape if it is a `rectangle`, which has its own way of
    sampling; in Mitsuba's order (0, 0), (1, 0), (0, 1), (1, 1) of (u, v).
    """
    plugin = objects.plugin_name(emitter)
    parts = objects.members(emitter)
    weight = float(emitter.sampling_weight())
    if not (weight >= 0 and math.isfinite(weight)):
        raise SceneError(f"{name} has sampling_weight = {weight}: it must be at least 0")
    if plugin == "area":
        radiance = objects.color(parts["radiance"], name)
        if corners is None:
            return Emitter("area", radiance, shape=shape, sampling_weight=weight)
        corner, along_u, along_v = corners[0], corners[1], corners[2]
        return Emitter(
            "area",
            radiance,
            shape=shape,
            rectangle=True,
            corner=objects.vec3(corner),
            edge_u=objects.vec3(along_u - corner),
            edge_v=objects.vec3(along_v - corner),
            sampling_weight=weight,
        )
    if plugin == "point":
        return Emitter(
            "point",
            objects.color(parts["intensity"], name),
            position=finite(objects.vec3(parts["position"]), name, "position"),
            sampling_weight=weight,
        )
    to_world = objects.matrix(emitter.world_transform())
    axis = unit_axis(to_world, name)
    if plugin == "directional":
        return Emitter(
            "directional",
            objects.color(parts["irradiance"], name),
            direction=axis,
            sampling_weight=weight,
        )
    if plugin == "spot":
        cutoff, beam = (objects.number(parts[n]) for n in ("cutoff_angle", "beam_width"))
        if not 0 <= beam <= cutoff < 180:
            raise SceneError(
                f"{name} has cutoff_angle = {cutoff:g} and beam_width = {beam:g}: the "
                "first must be below 180 and the second no larger than the first"
            )
        return Emitter(
            "spot",
            objects.color(parts["intensity"], name),
            position=finite(objects.vec3(to_world[:3, 3]), name, "position"),
            direction=axis,
            cutoff_angle=math.radians(cutoff),
            beam_width=math.radians(beam),
            sampling_weight=weight,
        )
    raise UnsupportedFeature(
        f"{name} is not supported: only point, spot, directional and area are so far"
    )


def finite(vector: Vec3, name: str, what: str) -> Vec3:
    """The vector; raises SceneError if it holds NaN or infinity."""
    if not all(math.isfinite(c) for c in vector):
        raise SceneError(f"{name} has a {what} of {vector}: it must be finite")
    return vector


def unit_axis(to_world: npt.NDArray[np.float64], name: str) -> Vec3:
    """World direction of the emitter's z axis.

    Raises UnsupportedFeature if the transformation scales, which distorts the emission, and
    SceneError if it is not finite.
    """
    axes = to_world[:3, :3]
    if not np.isfinite(to_world).all():
        raise SceneError(f"{name} has a to_world with NaN or infinite entries: repair it")
    if not np.allclose(axes.T @ axes, np.eye(3), atol=1e-3):
        raise UnsupportedFeature(
            f"{name} has a to_world that scales, which is not supported: use a rotation "
            "and a "
            "translation"
        )
    axis = axes[:, 2]
    return objects.vec3(axis / np.linalg.norm(axis))
