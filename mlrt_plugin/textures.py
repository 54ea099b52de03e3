"""Reads textures of a loaded scene; Mitsuba has read their images, and converts colours.

Formulas are of Mitsuba 3.9's bitmap.cpp, checkerboard.cpp and mesh_attribute.cpp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import mitsuba_objects as objects
from .elements import Element
from .errors import SceneError, UnsupportedFeature
from .loaded_bitmaps import asking, decoded_bytes, is_nearest, wrap_mode
from .texture_arrays import (
    AttributeTexture,
    BitmapTexture,
    CheckerboardTexture,
    ConstantTexture,
    Row,
    Texture,
)

LUMINANCE = (0.212671, 0.715160, 0.072169)
"""Weights of linear RGB (Mitsuba's core/spectrum.h)."""
VARYING = ("bitmap", "checkerboard", "mesh_attribute")
"""Plugins that are read here; constant ones aside."""


@dataclass(frozen=True)
class Surface:
    """The mesh that a texture lies on; `name` is what messages call it, `first_face` and
    `first_vertex` are numbers in the scene."""

    shape: Any
    name: str
    first_face: int
    first_vertex: int


class TextureTable:
    """Collects textures; equal ones share a number."""

    def __init__(self) -> None:
        self.textures: list[Texture] = []
        self._numbers: dict[Any, int] = {}
        self._uses_coordinates: set[int] = set()

    def uses_coordinates(self, number: int) -> bool:
        """Whether a texture depends on the (u, v) of the surface."""
        return number in self._uses_coordinates

    def add_colour(self, texture: Any, element: Element, surface: Surface) -> int:
        """Number of a loaded texture that is asked for colours.

        element: what the scene says of it. Raises SceneError for values that are not
        finite, a map that is singular, or an attribute that the mesh does not have, and
        UnsupportedFeature for what is not native.
        """
        return self._add(texture, element, surface, scalar=False)

    def add_scalar(self, texture: Any, element: Element, surface: Surface) -> int:
        """The same for one that is asked for a single number, such as an opacity."""
        return self._add(texture, element, surface, scalar=True)

    def _add(self, texture: Any, element: Element, surface: Surface, scalar: bool) -> int:
        plugin = objects.plugin_name(texture)
        if plugin == "checkerboard":
            return self._add_checkerboard(texture, element, surface, scalar)
        if plugin == "bitmap":
            key: tuple[Any, ...] = (texture.ptr, scalar)
            if key not in self._numbers:
                self._store(key, read_bitmap(texture, element, scalar))
                self._uses_coordinates.add(self._numbers[key])
            return self._numbers[key]
        if plugin == "mesh_attribute":
            key = (surface.first_face, str(texture), scalar)
            if key not in self._numbers:
                self._store(key, read_attribute(texture, element, surface, scalar))
            return self._numbers[key]
        if plugin not in ("uniform", "srgb"):
            raise UnsupportedFeature(
                f"{element} is not supported: only {', '.join(VARYING)} and constant "
                "colours are so far"
            )
        colour = objects.color(texture, str(element))
        if scalar:
            colour = (float(texture.mean()),) * 3
        constant = ConstantTexture(colour)
        return self._store(constant, constant)

    def _add_checkerboard(
        self, texture: Any, element: Element, surface: Surface, scalar: bool
    ) -> int:
        parts = objects.members(texture)
        to_u, to_v = to_uv_rows(parts["to_uv"], element)
        first, second = (
            self._add(parts[name], child_of(element, name, parts[name]), surface, scalar)
            for name in ("color0", "color1")
        )
        if scalar:
            # Mitsuba 3.9's eval_1 takes the other colour than its eval.
            first, second = second, first
        board = CheckerboardTexture(first, second, to_u, to_v)
        number = self._store(board, board)
        self._uses_coordinates.add(number)
        return number

    def _store(self, key: Any, texture: Texture) -> int:
        if key not in self._numbers:
            self._numbers[key] = len(self.textures)
            self.textures.append(texture)
        return self._numbers[key]


def child_of(element: Element, name: str, instance: Any) -> Element:
    """What a scene says of a nested object: the child of that name, else the only one of
    its kind."""
    plugin = objects.plugin_name(instance)
    children = [child for key, child in element.children if key == name]
    found = children or [c for _, c in element.children if c.plugin == plugin]
    return found[0] if len(found) == 1 else Element("texture", plugin, where=element.where)


def to_uv_rows(to_uv: Any, element: Element) -> tuple[Row, Row]:
    """The rows of a map of texture coordinates that matter."""
    matrix = np.array(to_uv.matrix, np.float64)
    rows = matrix[:2, [0, 1, -1]]
    if not np.isfinite(rows).all() or abs(np.linalg.det(rows[:, :2])) == 0:
        raise SceneError(
            f"{element} has a to_uv that is singular or not finite: no scale may be 0"
        )
    first, second = ((float(a), float(b), float(c)) for a, b, c in rows)
    return first, second


def read_bitmap(texture: Any, element: Element, scalar: bool) -> BitmapTexture:
    """The image of a loaded texture, with how the scene says that it is looked up."""
    parts = objects.members(texture)
    to_u, to_v = to_uv_rows(parts["to_uv"], element)
    texels = np.array(parts["data"])
    texels = texels.reshape(*parts["data"].shape)
    ask = asking(texture, texels, np.array([to_u, to_v], np.float64))
    decoded = None
    if texels.dtype == np.uint8:
        decoded = decoded_bytes(ask, texels)
    else:
        texels = texels.astype(np.float32)
        broken = int(np.count_nonzero(~np.isfinite(texels).all(axis=2)))
        if broken:
            file = element.properties.get("filename", "")
            raise SceneError(
                f"{element} has {broken} NaN or infinite pixels: repair its image "
                f"{file}".rstrip()
            )
    nearest = str(element.properties.get("filter_type", "bilinear")) == "nearest"
    wrap = str(element.properties.get("wrap_mode", "repeat"))
    if element.loaded:
        values = texels if decoded is None else decoded[texels]
        nearest, wrap = is_nearest(ask, values), wrap_mode(ask, values)
    if scalar and texels.shape[2] == 3:
        # Interpolation and luminance are linear both, so their order does not matter.
        linear = texels if decoded is None else decoded[texels]
        texels, decoded = (linear @ np.array(LUMINANCE, np.float32))[..., None], None
    height, width, channels = texels.shape
    return BitmapTexture(
        width=width,
        height=height,
        channels=channels,
        nearest=nearest,
        wrap=wrap,
        to_u=to_u,
        to_v=to_v,
        texels=np.ascontiguousarray(texels),
        decoded=decoded,
    )


def read_attribute(
    texture: Any, element: Element, surface: Surface, scalar: bool
) -> AttributeTexture:
    """The values of the mesh that a texture `mesh_attribute` names."""
    shape = surface.shape
    attribute = objects.described(texture, "name").strip('"')
    of_vertices = attribute.startswith("vertex_")
    available = [
        name for name in objects.members(shape) if name.startswith(("vertex_", "face_"))
    ]
    builtin = ("vertex_positions", "vertex_normals", "vertex_texcoords")
    available = [name for name in available if name not in builtin]
    if attribute not in available:
        listed = ", ".join(available) if available else "none"
        raise SceneError(
            f"{element} asks for the attribute '{attribute}', which {surface.name} does "
            f"not have: name one of its own ({listed}), or add it to the mesh"
        )
    count = shape.vertex_count() if of_vertices else shape.face_count()
    values = np.array(shape.attribute_buffer(attribute), np.float32)
    values = values.reshape(count, -1)
    channels = values.shape[1]
    if channels != 1 and (scalar or channels != 3):
        needed = "1 channel" if scalar else "1 or 3 channels"
        raise SceneError(
            f"{element} asks for the attribute '{attribute}' of {surface.name}, which has "
            f"{channels} channels: {needed} are needed"
        )
    if not np.isfinite(values).all():
        raise SceneError(
            f"{surface.name} has NaN or infinite values in its attribute '{attribute}': "
            "repair the mesh"
        )
    scale = np.float32(objects.described(texture, "scale", "1").strip('"'))
    return AttributeTexture(
        type="vertex_attribute" if of_vertices else "face_attribute",
        first=surface.first_vertex if of_vertices else surface.first_face,
        channels=channels,
        texels=np.ascontiguousarray(values * scale),
    )
