"""A scene of Mitsuba that knows the lights and the extent of another, but not its shapes.

A scene builds an acceleration structure over all of its shapes. Rays are answered
elsewhere here, and what else a scene is asked for are its lights and sensors.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np

from .. import mitsuba_objects as objects
from ..elements import kind_of


def light_scene(parts: list[Any], shapes: list[Any]) -> Any:
    """A scene of the sensors and lights among the parts of a scene, in their order.

    shapes: those of the whole scene, whose bounds it has, as distant lights need them.
    """
    properties = mi.Properties("scene")
    for number, part in enumerate(parts):
        kind = kind_of(part)
        if kind in ("sensor", "emitter") or (
            kind == "shape" and (part.emitter() is not None or part.sensor() is not None)
        ):
            properties[f"part_{number}"] = part
    module = objects.variant_module(shapes[0])
    low = np.fmin.reduce([np.array(shape.bbox().min) for shape in shapes])
    high = np.fmax.reduce([np.array(shape.bbox().max) for shape in shapes])
    bounds = module.Mesh("bounds", 3, 1)
    corners = np.array([low, high, high], np.float32)
    values = {
        "vertex_positions": corners.reshape(-1),
        "faces": np.arange(3, dtype=np.uint32),
    }
    objects.set_members(bounds, values)
    properties["bounds"] = bounds
    return module.Scene(properties)
