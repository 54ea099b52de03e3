"""Loads a scene in Mitsuba's variant `llvm_ad_rgb`, once it has been looked through."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

import mlrt_llvm

from .. import (
    camera,
    elements,
    features,
    integrators,
    parsing,
    scene_import,
    scene_objects,
)
from .. import mitsuba_objects as objects
from ..elements import Element
from ..errors import SceneError, UnsupportedFeature
from ..object_arrays import ANALYTIC_TYPES
from ..scene_arrays import Lighting
from .instances import check_instances, without_instances
from .light_scene import light_scene
from .mitsuba_log import captured_warnings

VARIANT = "llvm_ad_rgb"
GROUP = "ShapeGroupPlugin"
"""Mitsuba's class of the plugin `shapegroup`."""
IGNORED = {
    "medium": "participating media have no effect on direct illumination as `direct` "
    "renders it",
}
"""Kinds of elements that Mitsuba's `direct` leaves out, and what to say of it."""


@dataclass(frozen=True)
class MitsubaScene:
    """A scene that Mitsuba has loaded, one of its sensors, and what is asked for.

    scene: has all lights, but maybe not all shapes. shapes: all but groups, which are
    shapes that instances refer to. names, sampler_name: what messages call the shapes and
    the sampler.
    warnings: what is approximated or ignored, a sentence each.
    """

    scene: Any
    shapes: list[Any]
    groups: list[Any]
    sensor: Any
    names: list[str]
    lighting: Lighting
    warnings: tuple[str, ...]
    sampler_name: str = "the sampler"

    @property
    def module(self) -> Any:
        """Mitsuba's module of the variant."""
        return objects.variant_module(self.scene)


def load_scene(
    source: scene_import.SceneSource,
    *,
    reason: str,
    sensor: Any = 0,
    defines: Mapping[str, object] | None = None,
    resolution: tuple[int, int] | None = None,
    lighting: Lighting | None = None,
    force_direct: bool = False,
    summary: scene_import.SceneSummary | None = None,
) -> MitsubaScene:
    """Loads a scene; arguments as of `scene_import.import_scene`.

    reason: why it is not rendered natively, for messages.

    Raises SceneError if it cannot be loaded or makes no sense, and UnsupportedFeature if
    there is no libLLVM, if it is loaded in another variant, or if it uses what neither this
    package nor Mitsuba's `direct` renders.
    """
    try:
        mlrt_llvm.activate()
    except mlrt_llvm.LlvmUnavailable as error:
        raise UnsupportedFeature(
            f"the scene needs Mitsuba's own shading, because {reason}: {error}"
        ) from error
    if scene_import.is_loaded_scene(source):
        if defines:
            raise SceneError(
                "parameters cannot be defined for a scene that is already loaded"
            )
        return of_loaded(source, reason, sensor, resolution, lighting, force_direct)
    if summary is None or summary.parsed is None or isinstance(source, Mapping):
        parsed = scene_import.parse(source, defines, VARIANT)
    else:
        parsed = summary.parsed
        parsed.set_variant(VARIANT)
    if parsed.config.variant != VARIANT:
        raise UnsupportedFeature(
            f"the scene holds objects of the variant {parsed.config.variant} and needs "
            f"Mitsuba's own shading, because {reason}: load them in {VARIANT}"
        )
    root, name = parsed.root, f"scene '{parsed.name}'"
    scene_import.check_contents(root, sensor, name)
    found = features.list_features(root, sensor)
    lighting = lighting or scene_import.lighting_of(source, root)
    integrators.check_integrator(found, lighting, force_direct)
    features.refuse_refused(root, sensor)
    check_numbers(root, sensor)
    used = list(features.used_elements(root, sensor))
    scene_import.check_transforms(used)
    scene_import.check_files(parsed, used)
    if resolution is not None:
        scene_import.set_resolution(parsed, sensor, resolution)
    warnings = [
        *integrators.integrator_warnings(found, lighting),
        *ignored(root, sensor),
    ]
    with captured_warnings() as messages:
        parts, by_id = instantiated(parsed)
        groups = [part for part in parts if part.class_name() == GROUP]
        shapes = [p for p in parts if elements.kind_of(p) == "shape" and p not in groups]
        scene = parsing.reported(
            lambda: light_scene(parts, shapes), parsed.name, parsed.elements
        )
    chosen = list(root.children_of("sensor"))[sensor]
    eye = next(s for s in scene.sensors() if by_id.get(s.id()) is chosen)
    check_film(eye.film(), str(next(chosen.children_of("film"), chosen)))
    check_emitters(scene, {id_: str(element) for id_, element in by_id.items()})
    names = [str(by_id.get(shape.id(), shape.id())) for shape in shapes]
    warnings += [*messages, *small_lights(scene, shapes, names)]
    return MitsubaScene(
        scene,
        shapes,
        groups,
        eye,
        names,
        lighting,
        tuple(dict.fromkeys(warnings)),
        str(next(chosen.children_of("sampler"), "the sampler")),
    )


def instantiated(parsed: parsing.ParsedScene) -> tuple[list[Any], dict[str, Element]]:
    """The parts of a scene, instances of meshes written out, and the elements by the ids of
    what they became."""
    parts, by_id = parsing.instantiate(
        parsed, scene_objects.plain_instances(parsed, of_meshes_only=True)
    )
    children = scene_objects.group_children(parsed, by_id)
    instances = scene_objects.instances_of(parsed)
    return without_instances(parts, instances, by_id, children), by_id


def of_loaded(
    scene: Any,
    reason: str,
    sensor: Any,
    resolution: tuple[int, int] | None,
    lighting: Lighting | None,
    force_direct: bool,
) -> MitsubaScene:
    """A scene that the caller has loaded; see `load_scene`."""
    if scene.variant_name() != VARIANT:
        raise UnsupportedFeature(
            f"the scene is loaded in the variant {scene.variant_name()} and needs "
            f"Mitsuba's own shading, because {reason}: load it in {VARIANT}"
        )
    sensors, number = scene_import.sensors_of(scene, sensor)
    root = elements.from_scene(scene, sensors)
    scene_import.check_contents(root, number, "the scene")
    found = features.list_features(root, number)
    lighting = lighting or scene_import.lighting_of(scene, root)
    integrators.check_integrator(found, lighting, force_direct)
    features.refuse_refused(root, number)
    check_instances(sum(s.class_name() == "Instance" for s in scene.shapes()))
    check_emitters(scene, {})
    eye = sensors[number]
    size = tuple(int(n) for n in eye.film().size())
    if resolution is not None and resolution != size:
        raise SceneError(
            f"the scene is loaded with a film of {size[0]}x{size[1]} pixels, which cannot "
            "be changed with Mitsuba's own shading: change it in the scene"
        )
    check_film(eye.film(), str(elements.from_object(eye.film())))
    warnings = integrators.integrator_warnings(found, lighting)
    shapes = list(scene.shapes())
    groups = [
        part
        for part in objects.members(scene).values()
        if isinstance(part, mi.Object) and part.class_name() == GROUP
    ]
    names = [str(elements.from_object(shape)) for shape in shapes]
    warnings += small_lights(scene, shapes, names)
    return MitsubaScene(scene, shapes, groups, eye, names, lighting, tuple(warnings))


def check_emitters(scene: Any, names: Mapping[str, str]) -> None:
    """Raises SceneError for a light with NaN or infinite values, images included.

    names: what messages call the emitters, by their ids.
    """
    for emitter in scene.emitters():
        parts = objects.members(emitter)
        for name, part in parts.items():
            nested = objects.members(part) if isinstance(part, mi.Object) else {name: part}
            for value in nested.values():
                if not is_finite(value):
                    element = names.get(emitter.id(), str(elements.from_object(emitter)))
                    raise SceneError(
                        f"{element} has NaN or infinite values in its {name}: repair them"
                    )


def is_finite(value: Any) -> bool:
    """Whether all numbers of a parameter are finite, if it holds numbers."""
    if isinstance(value, (bool, str, mi.Object)):
        return True
    try:
        numbers = np.array(value, np.float64)
    except (TypeError, ValueError, RuntimeError):
        return True
    return bool(np.isfinite(numbers).all())


def small_lights(scene: Any, shapes: list[Any], names: list[str]) -> list[str]:
    """A sentence on each shape that glows and in which Mitsuba's plugins find no light from
    across the scene, as its cone of directions closes in single precision, or its density
    has no number."""
    bounds = scene.bbox()
    extent = float(np.max(np.array(bounds.max) - np.array(bounds.min)))
    return [
        f"{name} glows and is so small in a scene that measures {extent:.3g} that "
        "Mitsuba's plugins may find no light of it: enlarge it, or choose shading = native "
        "if the scene allows"
        for shape, name in zip(shapes, names, strict=True)
        if shape.emitter() is not None
        and (
            shape.is_mesh() or objects.plugin_name(shape) in ("rectangle", *ANALYTIC_TYPES)
        )
        and objects.number(shape.surface_area()) < smallest_area(shape) * extent**2
    ]


def smallest_area(shape: Any) -> float:
    """Of a light, as a share of the square of its distance, from where Mitsuba finds it."""
    if objects.plugin_name(shape) != "sphere":
        return 1e-12  # chosen: some 1e-20 is what its disks and cylinders need
    # 1 - sin^2 is 1 in single precision below a sine of 2^-12.5.
    return 4 * math.pi * 2.0**-25


def check_film(film: Any, name: str) -> None:
    """Raises SceneError for a film that does not fit into memory, or whose filter has no
    sensible size."""
    width, height = (int(n) for n in film.crop_size())
    camera.check_size(width, height, name)
    radius = float(film.rfilter().radius())
    if not 0 < radius <= camera.LARGEST_RADIUS:
        raise SceneError(
            f"the rfilter of {name} has a radius of {radius:g} pixels: change it"
        )


def check_numbers(root: Element, sensor: int) -> None:
    """Raises SceneError for an element with a number that is not finite.

    Transformations have a check of their own.
    """
    for element in features.used_elements(root, sensor):
        for name, value in element.properties.items():
            if name == "to_world" or isinstance(value, (bool, str)):
                continue
            try:
                numbers = np.asarray(value, np.float64)
            except (TypeError, ValueError):
                continue
            if element.kind == "shape" and name == "radius" and not numbers.all():
                raise SceneError(f"{element} has radius = 0: it must be larger")
            if np.isnan(numbers).any() or (
                element.kind in ("emitter", "texture") and not np.isfinite(numbers).all()
            ):
                raise SceneError(
                    f"{element} has {name} = {shown(numbers)}: it must be finite"
                )


def shown(numbers: Any) -> str:
    """A number, or several in brackets."""
    values = [f"{x:g}" if math.isfinite(x) else str(x) for x in numbers.reshape(-1)[:4]]
    return values[0] if len(values) == 1 else f"({', '.join(values)})"


def ignored(root: Element, sensor: int) -> list[str]:
    """What has no effect on the image, a sentence each."""
    warnings = [
        f"{element}: {IGNORED[element.kind]}"
        for element in features.used_elements(root, sensor)
        if element.kind in IGNORED
    ]
    for film in list(root.children_of("sensor"))[sensor].children_of("film"):
        pixels = film.properties.get("pixel_format", "rgb")
        if pixels != "rgb":
            warnings.append(f"film: pixel_format '{pixels}' is ignored, the image is RGB")
    return warnings
