"""Materials of a loaded scene as a table of reflectances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .elements import Element, from_object
from .errors import SceneError, UnsupportedFeature
from .scene_arrays import Vec3
from .shape_arrays import NONE, Specular
from .textures import VARYING, Surface, TextureTable, child_of

BLACK: Vec3 = (0.0, 0.0, 0.0)
SPECULAR = ("conductor", "dielectric", "thindielectric")
"""BSDFs that mirror and refract."""
DELTA = (*SPECULAR, "null")
"""BSDFs that no light sample finds, so that direct light leaves them black; what they
mirror or let through is found by BSDF samples."""


SPECULAR_COLOURS = {
    "reflectance": "specular_reflectance",
    "transmittance": "specular_transmittance",
    "eta": "eta",
    "k": "k",
}
"""Colours of mirrors and glass, and Mitsuba's names of them."""


@dataclass(frozen=True)
class Side:
    """What one side of a surface reflects: a colour, the number of a texture, or what it
    mirrors and refracts."""

    colour: Vec3 = BLACK
    texture: int = NONE
    specular: Specular | None = None


@dataclass(frozen=True)
class Material:
    """Both sides, and the texture of the share of light that they reflect at all.

    passes: whether light goes straight through. delta: whether no side scatters, so that
    Mitsuba takes no light sample.
    """

    front: Side = Side()
    back: Side = Side()
    opacity: int = NONE
    passes: bool = False
    delta: bool = False


class MaterialTable:
    """Collects materials; equal ones share a row.

    mirrors: whether BSDF samples look for lights in mirrors and glass, which are black
    else.
    """

    def __init__(self, mirrors: bool) -> None:
        self._mirrors = mirrors
        self.textures = TextureTable()
        self._rows: dict[Material, int] = {}

    def add(self, surface: Surface, elements: Mapping[str, Element]) -> int:
        """Number of the row of the material of a shape; `elements` are what the scene says,
        by the ids of objects. Raises what `TextureTable.add_colour` does."""
        bsdf = surface.shape.bsdf()
        element = elements.get(bsdf.id()) or from_object(bsdf)
        material = self._read(bsdf, element, surface)
        return self._rows.setdefault(material, len(self._rows))

    def array(self) -> npt.NDArray[np.float32]:
        """(M, 2, 3) linear RGB reflectances, front and back; black where there are
        textures."""
        rows = [(m.front.colour, m.back.colour) for m in self._rows]
        return np.array(rows, np.float32).reshape(-1, 2, 3)

    def texture_array(self) -> npt.NDArray[np.uint32]:
        """(M, 3) numbers of the textures of front, back and opacity, or NONE."""
        rows = [(m.front.texture, m.back.texture, m.opacity) for m in self._rows]
        return np.array(rows, np.uint32).reshape(-1, 3)

    def speculars(self) -> tuple[Specular, ...]:
        """All mirrors and glasses, each once."""
        sides = (s.specular for m in self._rows for s in (m.front, m.back))
        return tuple(dict.fromkeys(s for s in sides if s is not None))

    def specular_numbers(self) -> tuple[tuple[int, int, bool], ...]:
        """Numbers of those, of front and back of each row, or NONE, and whether it is
        delta; empty if none is."""
        numbers = {specular: number for number, specular in enumerate(self.speculars())}
        rows = tuple(
            (
                NONE if m.front.specular is None else numbers[m.front.specular],
                NONE if m.back.specular is None else numbers[m.back.specular],
                m.delta,
            )
            for m in self._rows
        )
        return rows if numbers else ()

    def passes(self) -> tuple[bool, ...]:
        """Which rows let all light straight through; empty if none does."""
        rows = tuple(material.passes for material in self._rows)
        return rows if any(rows) else ()

    def uses_coordinates(self) -> list[bool]:
        """Which rows depend on the texture coordinates of the surface."""
        return [
            any(map(self.textures.uses_coordinates, textures_of(material)))
            for material in self._rows
        ]

    def add_light(self, surface: Surface, elements: Mapping[str, Element]) -> int:
        """Number of the texture that the light on a shape shows; NONE for one colour, and
        for a shape that is no light. Raises as `add` does."""
        emitter = surface.shape.emitter()
        if emitter is None:
            return NONE
        return self.add_picture(emitter, surface, elements)

    def add_picture(
        self, emitter: Any, surface: Surface, elements: Mapping[str, Element]
    ) -> int:
        """The same for an emitter, which may be a projector; NONE for all others."""
        name = {"area": "radiance", "projector": "irradiance"}.get(
            objects.plugin_name(emitter), ""
        )
        shown = objects.members(emitter)[name] if name else None
        if shown is None or objects.plugin_name(shown) not in VARYING:
            return NONE
        element = elements.get(emitter.id()) or from_object(emitter)
        return self.textures.add_colour(shown, child_of(element, name, shown), surface)

    def _read(self, bsdf: Any, element: Element, surface: Surface) -> Material:
        plugin = objects.plugin_name(bsdf)
        if plugin in SPECULAR and self._mirrors:
            side = Side(specular=self._specular(bsdf, plugin, element, surface))
            behind = Side() if plugin == "conductor" else side
            return Material(side, behind, delta=True)
        if plugin in DELTA:
            return Material(passes=plugin == "null")
        parts = objects.members(bsdf)
        if plugin == "diffuse":
            return Material(self._side(parts["reflectance"], element, surface))
        if plugin == "twosided":
            nested = list(element.children_of("bsdf"))
            sides = [parts["brdf_0"], parts.get("brdf_1", parts["brdf_0"])]
            front, back = (
                self._read(
                    side, nested[min(i, len(nested) - 1)] if nested else element, surface
                )
                for i, side in enumerate(sides)
            )
            return Material(front.front, back.front, delta=front.delta and back.delta)
        if plugin == "mask":
            inner = next(element.children_of("bsdf"), element)
            material = self._read(parts["nested_bsdf"], inner, surface)
            opacity = parts["opacity"]
            number = self.textures.add_scalar(
                opacity, child_of(element, "opacity", opacity), surface
            )
            if material.passes:
                return material
            return Material(material.front, material.back, number, delta=material.delta)
        raise UnsupportedFeature(
            f"bsdf '{plugin}' of {surface.name} is not supported: only diffuse, twosided, "
            f"mask, {', '.join(DELTA)} are so far"
        )

    def _side(self, reflectance: Any, element: Element, surface: Surface) -> Side:
        """Of a material `diffuse`."""
        if objects.plugin_name(reflectance) in ("uniform", "srgb"):
            return Side(objects.color(reflectance, f"bsdf of {surface.name}"))
        child = child_of(element, "reflectance", reflectance)
        return Side(texture=self.textures.add_colour(reflectance, child, surface))

    def _specular(
        self, bsdf: Any, plugin: str, element: Element, surface: Surface
    ) -> Specular:
        """What a mirror or glass does; raises what `mitsuba_objects.color` does."""
        parts, owner = objects.members(bsdf), f"bsdf of {surface.name}"
        fields: dict[str, Any] = {}
        for name, key in SPECULAR_COLOURS.items():
            value = parts.get(key)
            if not isinstance(value, mi.Object):
                continue
            if name not in ("eta", "k") and objects.plugin_name(value) in VARYING:
                fields[f"{name}_texture"] = self.textures.add_colour(
                    value, child_of(element, key, value), surface
                )
            else:
                fields[name] = objects.color(value, owner)
        ior = 1.0 if plugin == "conductor" else objects.number(parts["eta"])
        if not (ior > 0 and math.isfinite(ior)):
            raise SceneError(
                f"{owner} has an index of refraction of {ior}: make it positive"
            )
        return Specular(plugin, **fields, ior=ior)


def textures_of(material: Material) -> list[int]:
    """The numbers of all that a material shows."""
    numbers = [material.front.texture, material.back.texture, material.opacity]
    for side in (material.front, material.back):
        if side.specular is not None:
            numbers.append(side.specular.reflectance_texture)
            numbers.append(side.specular.transmittance_texture)
    return numbers
