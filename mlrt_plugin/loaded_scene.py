"""The objects that Mitsuba has loaded of a scene."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from . import elements
from . import mitsuba_objects as objects
from .elements import Element


@dataclass(frozen=True)
class LoadedScene:
    """The objects of a loaded scene, each kind in the order of declaration.

    groups: the shapes of each shapegroup, by its id. instances: what the scene says of
    them, of which there may be very many.
    """

    shapes: list[Any]
    emitters: list[Any]
    sensors: list[Any]
    groups: dict[str, list[Any]] = field(default_factory=dict)
    instances: list[Element] = field(default_factory=list)

    @staticmethod
    def of_parts(parts: list[Any]) -> LoadedScene:
        """Sorts objects by kind, the way a `scene` of Mitsuba does (scene.cpp)."""
        scene = LoadedScene([], [], [])
        for part in parts:
            kind = elements.kind_of(part)
            if kind == "shape":
                scene.shapes.append(part)
                if part.emitter() is not None:
                    scene.emitters.append(part.emitter())
            elif kind == "emitter" and objects.plugin_name(part) != "area":
                # An area light that stands alone is only declared, for a shape to refer to.
                scene.emitters.append(part)
            elif kind == "sensor":
                scene.sensors.append(part)
        return scene
