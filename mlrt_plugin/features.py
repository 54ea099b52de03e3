"""What of a scene is rendered natively, what is approximated, and what is not supported."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from . import mitsuba_objects as objects
from .elements import Element, walk_once
from .errors import UnsupportedFeature
from .materials import DELTA
from .object_arrays import ANALYTIC_TYPES
from .scene_arrays import Feature
from .textures import VARYING

MESHES = ("obj", "ply", "serialized", "rectangle", "cube", "mesh")
SHAPES = (*MESHES, *ANALYTIC_TYPES, "shapegroup", "instance")
BSDFS = ("diffuse", "twosided", "mask", *DELTA)
EMITTERS = ("point", "spot", "projector", "directional", "area", "constant", "envmap")
SENSORS = ("perspective", "thinlens", "orthographic")
FILMS = ("hdrfilm",)
FILTERS = ("box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos")
SAMPLERS = ("independent", "stratified", "multijitter", "orthogonal", "ldsampler")
CONSTANT_TEXTURES = ("uniform", "srgb", "d65")
TEXTURES = (*CONSTANT_TEXTURES, *VARYING)
LIGHT_TEXTURES = ("bitmap", "checkerboard")
"""Of those that vary, what an area light and a projector can show."""

NOT_TURNED = 1e-6
"""What an axis may have of another, relatively; chosen."""
NOT_RGB = "RGB variants do not have it: write the colour as <rgb> or <spectrum value>"
REFUSED = {
    ("texture", "regular"): NOT_RGB,
    ("texture", "irregular"): NOT_RGB,
    ("texture", "blackbody"): NOT_RGB,
    ("emitter", "timed_sunsky"): "Mitsuba 3.9.1 cannot sample it in its llvm variants",
    ("sensor", "batch"): "render its sensors one by one, each declared in the scene",
    ("sensor", "irradiancemeter"): "sensors that belong to shapes cannot be chosen",
    ("film", "specfilm"): "it records spectra, and images are RGB: use hdrfilm",
}
"""Plugins that are rendered neither natively nor by Mitsuba, and why."""

NATIVE = {
    "shape": SHAPES,
    "bsdf": BSDFS,
    "emitter": EMITTERS,
    "sensor": SENSORS,
    "film": FILMS,
    "rfilter": FILTERS,
    "sampler": SAMPLERS,
    "texture": TEXTURES,
}


def used_elements(scene: Element, sensor: int) -> Iterator[Element]:
    """The elements that the image depends on: shapes, emitters, the chosen sensor, and what
    these hold. What is declared but never referred to is left out."""
    sensors = [e for n, e in enumerate(scene.children_of("sensor")) if n == sensor]
    # An area light counts where a shape refers to it.
    lights = [e for e in scene.children_of("emitter") if e.plugin != "area"]
    return walk_once([*sensors, *scene.children_of("shape"), *lights])


def reason_against(element: Element) -> str:
    """Why an element cannot be rendered natively; empty if it can."""
    kind, plugin = element.kind, element.plugin
    if kind not in NATIVE:
        return f"a {kind} is not supported yet"
    if plugin not in NATIVE[kind]:
        return (
            f"only {', '.join(n for n in NATIVE[kind] if n != 'mesh')} are supported so far"
        )
    if plugin == "instance":
        if element.properties.get("loaded"):
            return "what a loaded instance refers to cannot be told: give the file"
        return ""
    if plugin == "spot" and any(
        name == "texture" and child.plugin != "uniform" for name, child in element.children
    ):
        return "the texture of a spot is not supported yet"
    if plugin in ("spot", "directional") and scales(element.properties.get("to_world")):
        return "its to_world scales, which is not supported yet"
    if kind == "emitter" and any(
        part.plugin in VARYING and part.plugin not in LIGHT_TEXTURES
        for part in element.walk()
    ):
        return f"of textures it can have {', '.join(LIGHT_TEXTURES)} only so far"
    if kind == "shape" and any(element.children_of("texture")):
        return "textures that are attributes of a shape are not supported yet"
    if kind == "shape" and has_textured_light(element):
        if plugin not in ("rectangle", *ANALYTIC_TYPES):
            return (
                "lights with a texture are supported on rectangles, "
                f"{', '.join(ANALYTIC_TYPES)} only so far"
            )
        if plugin != "disk" and plugin in ANALYTIC_TYPES and is_turned(element):
            return "its light has a texture and is turned"
        if plugin == "rectangle" and element.properties.get("flip_normals", False):
            return "its light has a texture and is turned by flip_normals"
    if plugin in (*ANALYTIC_TYPES, "shapegroup") and has_attributes(element):
        return "textures of the type mesh_attribute are not supported on it yet"
    if plugin == "orthogonal" and element.properties.get("strength", 2) != 2:
        return "only arrays of strength 2 are supported so far"
    if plugin == "orthographic" and shears(element.properties.get("to_world")):
        return "its to_world shears, which is not supported yet"
    if plugin == "twosided" and any(
        child.plugin not in ("diffuse", "conductor")
        for child in element.children_of("bsdf")
    ):
        return "only diffuse materials and conductors can be nested in it so far"
    if plugin == "mask" and any(c.plugin == "mask" for c in element.children_of("bsdf")):
        return "a mask in a mask is not supported yet"
    return ""


def has_textured_light(shape: Element) -> bool:
    """Whether a shape is an area light whose radiance varies."""
    return any(
        texture.plugin in VARYING
        for emitter in shape.children_of("emitter")
        for texture in emitter.children_of("texture")
    )


def is_turned(shape: Element) -> bool:
    """Whether the axes of a sphere or cylinder, of which the z axis leads along the
    latter, are not those of the world, up to scales.

    Mitsuba 3.9 looks for a point of a texture on such a shape along a line that it does not
    turn with it, and may find another point.
    """
    axes = np.eye(3)
    to_world = shape.properties.get("to_world")
    if to_world is not None:
        axes = objects.matrix(to_world)[:3, :3]
    if shape.plugin == "cylinder":
        ends = (
            shape.properties.get("p0", (0, 0, 0)),
            shape.properties.get("p1", (0, 0, 1)),
        )
        x, y, z = (float(b) - float(a) for a, b in zip(*ends, strict=True))
        if z <= 0 or max(abs(x), abs(y)) > NOT_TURNED * z:
            return True
    diagonal = np.diag(axes)
    others = np.abs(axes - np.diag(diagonal)).max()
    return bool(diagonal.min() <= 0 or others > NOT_TURNED * diagonal.min())


def has_attributes(shape: Element) -> bool:
    """Whether a shape, or one of a group, shows what is stored with its mesh."""
    return any(part.plugin == "mesh_attribute" for part in shape.walk())


def shears(to_world: Any) -> bool:
    """Whether a transformation, None for none, makes axes that are not orthogonal; False
    also if it is not finite or flattens, which is told elsewhere."""
    if to_world is None:
        return False
    matrix = objects.matrix(to_world)
    if not np.isfinite(matrix).all() or objects.is_singular(matrix):
        return False
    return not objects.is_orthogonal(matrix)


def scales(to_world: Any) -> bool:
    """Whether a transformation, None for none, is more than a rotation and a translation;
    False also if it is not finite or flattens, which is told elsewhere."""
    if to_world is None:
        return False
    matrix = objects.matrix(to_world)
    if not np.isfinite(matrix).all() or objects.is_singular(matrix):
        return False
    axes = matrix[:3, :3]
    return not np.allclose(axes.T @ axes, np.eye(3), atol=objects.ORTHOGONAL)


def refuse_refused(scene: Element, sensor: int) -> None:
    """Raises UnsupportedFeature for what not even Mitsuba's plugins help with."""
    chosen = list(scene.children_of("sensor"))[sensor]
    for element in used_elements(scene, sensor):
        reason = REFUSED.get((element.kind, element.plugin), "")
        if reason and (element.kind != "sensor" or element is chosen):
            raise UnsupportedFeature(f"{element} is not supported: {reason}")


def list_features(scene: Element, sensor: int) -> tuple[Feature, ...]:
    """All elements that the image depends on, with the verdict on each."""
    found = [*used_elements(scene, sensor), *scene.children_of("integrator")]
    return tuple(
        Feature(
            e.kind,
            e.plugin,
            e.id,
            e.where,
            "" if e.kind == "integrator" else reason_against(e),
            e.kind == "bsdf" and has_varying_index(e),
        )
        for e in found
    )


def has_varying_index(bsdf: Element) -> bool:
    """Whether the complex index of refraction of a BSDF is not the same everywhere."""
    return any(
        part.plugin in VARYING
        for name, child in bsdf.children
        if name in ("eta", "k")
        for part in child.walk()
    )


def refuse_unsupported(features: tuple[Feature, ...]) -> None:
    """Raises UnsupportedFeature with all that is not supported, each by its name."""
    unsupported = [f for f in features if not f.native]
    if not unsupported:
        return
    first = unsupported[0]
    message = f"{first} is not supported: {first.reason}"
    others: dict[str, list[str]] = {}
    for feature in unsupported[1:]:
        others.setdefault(f"{feature.kind} '{feature.plugin}'", []).append(
            place(feature, first.file)
        )
    if others:
        named = [f"{plugin} {', '.join(places)}" for plugin, places in others.items()]
        message += f"; not supported either: {'; '.join(named)}"
    raise UnsupportedFeature(message)


def place(feature: Feature, file: str) -> str:
    """Where an element is, its file left out if it is the one given."""
    where = feature.where
    if file and feature.file == file:
        where = where.removeprefix(file).lstrip()
    return " ".join(filter(None, (f"'{feature.id}'" if feature.id else "", where)))
