"""Light sources of a loaded scene."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from . import mitsuba_objects as objects
from .elements import Element
from .errors import SceneError, UnsupportedFeature
from .materials import BLACK
from .object_arrays import ANALYTIC_TYPES, ObjectArrays
from .scene_arrays import Emitter, SceneArrays, Vec2, Vec3, no_environment
from .shape_arrays import NONE, Shape
from .textures import LUMINANCE

WHITE: Vec3 = (1.0, 1.0, 1.0)
UNDECIDED = 1e-3
"""Differences of densities below that make none in images; chosen."""
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
    element: Element | None = None,
) -> Emitter:
    """Reads one emitter.

    shape: number of the shape that glows, for an area light. texture: number of what it, or
    a projector, shows in place of one colour. element: what the scene says of it, None for
    one that was loaded.
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
            return Emitter(
                "area",
                radiance,
                shape=shape,
                radiance_texture=texture,
                sampling_weight=weight,
            )
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
    if plugin in ("envmap", "projector"):
        scale = objects.number(parts["scale"])
        if not (scale >= 0 and math.isfinite(scale)):
            raise SceneError(f"{name} has scale = {scale:g}: it must be at least 0")
        objects.check_invertible(to_world, name)
        first, second, third = (objects.vec3(column) for column in to_world[:3, :3].T)
        if plugin == "projector":
            colour = WHITE if texture != NONE else objects.color(parts["irradiance"], name)
            return Emitter(
                "projector",
                objects.vec3(scale * np.array(colour)),
                position=finite(objects.vec3(to_world[:3, 3]), name, "position"),
                radiance_texture=texture,
                axes=(first, second, third),
                half_size=half_size_of(emitter, to_world),
                sampling_weight=weight,
            )
        return Emitter(
            "envmap",
            (scale, scale, scale),
            axes=(first, second, third),
            mis_compensation=is_compensated(emitter, to_world)
            if element is None
            else bool(element.properties.get("mis_compensation", False)),
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
        f"{name} is not supported: only point, spot, projector, directional, area, "
        "constant and envmap are so far"
    )


def half_size_of(projector: Any, to_world: npt.NDArray[np.float64]) -> Vec2:
    """Half the width and height that a projector's picture has at the distance 1.

    Mitsuba 3.9 keeps the field of view to itself, but tells where in the picture a point
    lies; there, as in a camera, x points left.
    """
    module = objects.variant_module(projector)
    place = module.SurfaceInteraction3f()
    place.p = module.Point3f(*(to_world @ [-0.25, -0.25, 1, 1])[:3].tolist())
    sample, _ = projector.sample_direction(place, module.Point2f(0.5, 0.5))
    u, v = np.asarray(sample.uv, np.float64).reshape(-1)
    return 0.125 / (float(u) - 0.5), 0.125 / (float(v) - 0.5)


def is_compensated(envmap: Any, to_world: npt.NDArray[np.float64]) -> bool:
    """Whether a loaded `envmap` has `mis_compensation`, which Mitsuba 3.9 keeps to itself.

    Its light samples are then as dense as the picture is brighter than its mean. That is
    decided by the pixel that is chosen most differently beside the brightest one.
    """
    picture = read_environment(envmap, "envmap")
    light = picture.astype(np.float64) @ LUMINANCE
    mean, inner = light.mean(), light[1:-1]
    brightest = inner.max()
    if not brightest > mean:
        return False
    plain = inner / brightest
    compensated = np.maximum(inner - mean, 0) / (brightest - mean)
    differences = np.abs(plain - compensated)
    if differences.max() < UNDECIDED:
        return False
    places = [np.unravel_index(int(np.argmax(a)), a.shape) for a in (differences, inner)]
    module = objects.variant_module(envmap)

    def density(row: int, column: int) -> float:
        height, width = light.shape
        theta, phi = math.pi * row / (height - 1), 2 * math.pi * (column + 0.5) / width
        local = (
            math.sin(phi) * math.sin(theta),
            math.cos(theta),
            -math.cos(phi) * math.sin(theta),
        )
        way = to_world[:3, :3] @ local
        sample = module.DirectionSample3f()
        sample.d = module.Vector3f(*(way / np.linalg.norm(way)).tolist())
        place = module.SurfaceInteraction3f()
        return objects.number(envmap.pdf_direction(place, sample))

    answers = [density(int(row) + 1, int(column)) for row, column in places]
    ratio = answers[0] / answers[1]
    return bool(abs(ratio - compensated[places[0]]) < abs(ratio - plain[places[0]]))


def light_warnings(lights: Iterable[Emitter], bsdf_samples: int) -> list[str]:
    """What of the light is missing, as it is in Mitsuba."""
    if bsdf_samples == 0 and any(light.mis_compensation for light in lights):
        return [
            "the envmap has mis_compensation, which leaves what is darker than its mean to "
            "BSDF samples, and there are none: their light is missing, as in Mitsuba"
        ]
    return []


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
