"""Light sources of a loaded scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .errors import SceneError, UnsupportedFeature
from .materials import BLACK
from .object_arrays import ANALYTIC_TYPES, ObjectArrays
from .scene_arrays import Emitter, SceneArrays, Vec3, no_environment
from .shape_arrays import NONE, Shape

SMALLEST_EXTENT = float(np.sqrt(np.finfo(np.float32).tiny))
LARGEST_EXTENT = float(np.sqrt(np.finfo(np.float32).max / 3))
"""Squares of distances along a diagonal between these are normal numbers."""
SMALLEST_AREA = 2.0**-120
"""Of what glows: the reciprocal, and shares of it, are normal numbers."""


def read_emitter(
    emitter: Any,
    name: str,
    shape: int,
    corners: npt.NDArray[np.float32] | None,
    texture: int = NONE,
) -> Emitter:
    """Reads one emitter.

    shape: number of the shape that glows, for an area light. texture: number of what it
    shows in place of one colour, for a `rectangle`.
    corners: (4, 3) vertices of that shape if it is a `rectangle`, which has its own way of
    sampling; in Mitsuba's order (0, 0), (1, 0), (0, 1), (1, 1) of (u, v).
    """
    plugin = objects.plugin_name(emitter)
    parts = objects.members(emitter)
    weight = float(emitter.sampling_weight())
    if not (weight >= 0 and math.isfinite(weight)):
        raise SceneError(f"{name} has sampling_weight = {weight}: it must be at least 0")
    if plugin == "area":
        radiance = BLACK if texture != NONE else objects.color(parts["radiance"], name)
        if corners is None:
            return Emitter("area", radiance, shape=shape, sampling_weight=weight)
        corner, along_u, along_v = corners[0], corners[1], corners[2]
        return Emitter(
            "area",
            radiance,
            shape=shape,
            radiance_texture=texture,
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
    if plugin == "constant":
        return Emitter(
            "constant", objects.color(parts["radiance"], name), sampling_weight=weight
        )
    to_world = objects.matrix(emitter.world_transform())
    if plugin == "envmap":
        scale = objects.number(parts["scale"])
        if not (scale >= 0 and math.isfinite(scale)):
            raise SceneError(f"{name} has scale = {scale:g}: it must be at least 0")
        objects.check_invertible(to_world, name)
        first, second, third = (objects.vec3(column) for column in to_world[:3, :3].T)
        return Emitter(
            "envmap",
            (scale, scale, scale),
            axes=(first, second, third),
            sampling_weight=weight,
        )
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
        f"{name} is not supported: only point, spot, directional, area, constant and "
        "envmap are so far"
    )


def environment_of(
    sources: Iterable[Any], name_of: Callable[[Any], str]
) -> npt.NDArray[np.float32]:
    """The picture of the emitter that is an `envmap`; without pixels if none is. See
    `read_environment`."""
    for source in sources:
        if objects.plugin_name(source) == "envmap":
            return read_environment(source, name_of(source))
    return no_environment()


def read_environment(emitter: Any, name: str) -> npt.NDArray[np.float32]:
    """(H, W, 3) float32 picture of an `envmap`, without its scale.

    Raises SceneError if it holds NaN or infinity.
    """
    # Mitsuba puts a copy of the last column before the first, and one of the first behind.
    padded = np.array(objects.members(emitter)["data"], np.float32)
    picture = np.ascontiguousarray(padded[:, 1:-1, :3])
    if not np.isfinite(picture).all():
        file = objects.described(emitter, "filename", "its bitmap").strip('"')
        raise SceneError(f"{name} has NaN or infinite pixels: repair '{file}'")
    return picture


def check_distances(lights: Iterable[Emitter], bounds: tuple[Vec3, Vec3]) -> None:
    """Raises SceneError for a scene in which light cannot fall off.

    It does with the square of the distance, which single precision has no number for in
    scenes beyond all measure. Directional light and that from all around do not fall off.
    bounds: of all that can be hit.
    """
    if bounds[0] > bounds[1]:
        return
    for light in lights:
        if light.type in ("directional", "constant", "envmap"):
            continue
        points = [*bounds, light.position] if light.type != "area" else [*bounds]
        extent = float(np.ptp(np.array(points, np.float64), axis=0).max())
        if not SMALLEST_EXTENT <= extent <= LARGEST_EXTENT:
            raise SceneError(
                f"the scene measures {extent:.3g} with its '{light.type}' light: the "
                "square of that is out of the range of single precision, scale the scene"
            )


def check_areas(arrays: SceneArrays, bounds: tuple[Vec3, Vec3]) -> None:
    """Raises SceneError for a shape that glows and whose area is not zero, but too small a
    number for single precision, alone or beside the square of the scene's extent: it would
    be dark.

    bounds: of all that can be hit.
    """
    extent = float(np.ptp(np.array(bounds, np.float64), axis=0).max())
    names = arrays.shape_names
    if arrays.objects is not None:
        names += arrays.objects.shape_names
    for number, shape in enumerate(arrays.all_shapes()):
        if shape.emitter == NONE:
            continue
        others = arrays.objects
        if others is None or shape.first_face < len(arrays.faces):
            area = mesh_area(arrays, shape)
        else:
            area = analytic_area(others, shape)
        if 0 < area < SMALLEST_AREA * max(1.0, extent**2):
            name = names[number] if number < len(names) else f"shape {number}"
            beside = f" in a scene that measures {extent:.3g}" if extent > 1 else ""
            raise SceneError(
                f"{name} glows and has an area of {area:.3g}{beside}, which is out of the "
                "range of single precision: enlarge the light or remove it"
            )


def mesh_area(arrays: SceneArrays, shape: Shape) -> float:
    """Of the faces of a mesh that are finite."""
    faces = arrays.faces[shape.first_face : shape.first_face + shape.face_count]
    a, b, c = (arrays.vertices[faces[:, k]].astype(np.float64) for k in range(3))
    with np.errstate(invalid="ignore"):
        area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return float(np.nansum(area))


def analytic_area(objects: ObjectArrays, shape: Shape) -> float:
    """Of a shape of the scene that is not cut into triangles, as the core has it."""
    first = objects.shapes[-len(objects.analytic_types)].first_face
    number = shape.first_face - first
    x, y, z = objects.analytic_frames[number][:, :3].T
    plugin = ANALYTIC_TYPES[objects.analytic_types[number]]
    if plugin == "sphere":
        return 4 * math.pi * float(x @ x)
    if plugin == "disk":
        return math.pi * float(np.linalg.norm(np.cross(x, y)))
    return 2 * math.pi * float(np.linalg.norm(x) * np.linalg.norm(z))


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
    objects.check_finite(to_world, name)
    if not np.allclose(axes.T @ axes, np.eye(3), atol=objects.ORTHOGONAL):
        raise UnsupportedFeature(
            f"{name} has a to_world that scales, which is not supported: use a rotation "
            "and a "
            "translation"
        )
    axis = axes[:, 2]
    return objects.vec3(axis / np.linalg.norm(axis))
