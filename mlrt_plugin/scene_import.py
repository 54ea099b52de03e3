"""Reads a Mitsuba scene into plain arrays: from a file, a dictionary, or a loaded scene."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from . import camera as cameras
from . import (
    elements,
    emitters,
    features,
    integrators,
    meshes,
    parsing,
    samplers,
    scene_objects,
)
from . import mitsuba_objects as objects
from .elements import Element
from .errors import SceneError, UnsupportedFeature
from .image_headers import check_image_file
from .loaded_scene import LoadedScene
from .materials import MaterialTable
from .mesh_files import check_mesh_file
from .options import checked_resolution, integer
from .scene_arrays import Feature, Lighting, SceneArrays
from .shape_arrays import NONE, Shape
from .texture_coordinates import gather_coordinates
from .textures import Surface

SceneSource = Any
"""A path of an XML file, a dictionary as ``mi.load_dict`` takes it, or a loaded
``mi.Scene``."""


ENVIRONMENTS = ("constant", "envmap", "sunsky", "timed_sunsky")
"""Emitters that light a scene from all around."""


@dataclass(frozen=True)
class SceneSummary:
    """What a scene uses, found without loading its meshes.

    root: its elements. parsed: what it was read from, None for a scene that was loaded.
    """

    features: tuple[Feature, ...]
    lighting: Lighting
    root: Element
    parsed: parsing.ParsedScene | None = None

    @property
    def sensor_count(self) -> int:
        return len(list(self.root.children_of("sensor")))


def import_scene(
    scene: SceneSource,
    *,
    sensor: Any = 0,
    defines: Mapping[str, object] | None = None,
    resolution: tuple[int, int] | None = None,
    lighting: Lighting | None = None,
    force_direct: bool = False,
    summary: SceneSummary | None = None,
) -> SceneArrays:
    """Reads a scene.

    sensor: number of the sensor, in the order of declaration; of a loaded scene also a
    sensor itself.
    defines: values of $parameters, for a file only.
    resolution: (width, height) of the film in pixels in place of the scene's own. The
    field of view follows the film as the scene says, except that of a loaded scene, whose
    horizontal field of view is kept.
    lighting: what to render in place of what the scene's integrator asks for.
    force_direct: whether to render direct illumination where the integrator asks for more.
    summary: what `summarise` gave for the same scene, sensor and defines, so that it is not
    parsed again; each can be used once, and RuntimeError is raised after that.

    Raises SceneError if the scene cannot be read or makes no sense, and UnsupportedFeature
    if it uses what is not rendered natively.
    """
    if not isinstance(sensor, mi.Object):
        sensor = integer(sensor, "sensor")
    if resolution is not None:
        resolution = checked_resolution(resolution)
    if is_loaded_scene(scene):
        if defines:
            raise SceneError(
                "parameters cannot be defined for a scene that is already loaded"
            )
        if not scene.variant_name().endswith("_rgb"):
            raise SceneError(
                f"the scene is loaded in the variant {scene.variant_name()}: load it in an "
                "RGB variant"
            )
    if summary is None:
        summary = summarise(scene, sensor=sensor, defines=defines)
    names: dict[str, Element] = {}
    if summary.parsed is None:
        sensors, sensor = sensors_of(scene, sensor)
        loaded = LoadedScene(list(scene.shapes()), list(scene.emitters()), sensors)
    found, parsed = summary.features, summary.parsed
    name = f"scene '{parsed.name}'" if parsed is not None else "the scene"
    check_contents(summary.root, sensor, name)
    features.refuse_unsupported(found)
    if lighting is None:
        lighting = summary.lighting
    integrators.check_integrator(found, lighting, force_direct)
    obstacle = integrators.native_obstacle(found, lighting)
    if obstacle:
        raise UnsupportedFeature(obstacle)
    warnings = integrators.integrator_warnings(found, lighting)
    if parsed is not None:
        used = list(features.used_elements(parsed.root, -1))
        # Where instances stand is read, and checked, later.
        check_transforms([e for e in used if e.plugin != "instance"])
        check_files(parsed, used)
        if resolution is not None:
            set_resolution(parsed, sensor, resolution)
        parts, names = parsing.instantiate(parsed, scene_objects.plain_instances(parsed))
        loaded = replace(
            LoadedScene.of_parts(parts),
            groups=scene_objects.group_children(parsed, names),
            instances=scene_objects.instances_of(parsed),
        )
    return collect(loaded, names, sensor, resolution, found, lighting, warnings)


def summarise(
    scene: SceneSource, *, sensor: Any = 0, defines: Mapping[str, object] | None = None
) -> SceneSummary:
    """What a scene uses, natively or not, without loading it.

    Raises SceneError if it cannot be parsed.
    """
    if is_loaded_scene(scene):
        sensors, sensor = sensors_of(scene, sensor)
        root, parsed = elements.from_scene(scene, sensors), None
    else:
        parsed = parse(scene, defines)
        root = parsed.root
    found = features.list_features(root, sensor)
    return SceneSummary(found, lighting_of(scene, root), root, parsed)


def lighting_of(scene: SceneSource, root: Element) -> Lighting:
    """What the scene's integrator asks for."""
    if is_loaded_scene(scene):
        return integrators.loaded_lighting(scene)
    return integrators.lighting_of(root)


def is_loaded_scene(scene: SceneSource) -> bool:
    """Whether a source is a scene that Mitsuba has loaded; TypeError for other objects."""
    if not isinstance(scene, mi.Object):
        return False
    kind = elements.kind_of(scene)
    if kind != "scene":
        raise TypeError(f"a loaded mi.Scene is needed, not a {kind}")
    return True


def sensors_of(scene: Any, sensor: Any) -> tuple[list[Any], int]:
    """The sensors of a loaded scene and the number of the chosen one, maybe a stranger."""
    sensors = list(scene.sensors())
    if not isinstance(sensor, mi.Object):
        return sensors, int(sensor)
    for number, candidate in enumerate(sensors):
        if candidate is sensor:
            return sensors, number
    return [*sensors, sensor], len(sensors)


def parse(
    scene: SceneSource,
    defines: Mapping[str, object] | None,
    variant: str = parsing.READING_VARIANT,
) -> parsing.ParsedScene:
    """Parses a file or a dictionary, to be loaded in a variant."""
    if isinstance(scene, Mapping):
        if defines:
            raise SceneError("parameters cannot be defined for a scene dictionary")
        parsed = parsing.parse_dict(scene, variant)
    elif isinstance(scene, (str, os.PathLike)):
        parsed = parsing.parse_file(Path(scene), defines or {}, variant)
    else:
        raise TypeError(
            "a scene is a path, a dictionary or a loaded mi.Scene, not "
            f"{type(scene).__name__}"
        )
    if parsed.root.kind != "scene":
        raise SceneError(
            f"scene '{parsed.name}' holds a {parsed.root.kind}: its root must be a scene"
        )
    return parsed


def check_contents(root: Element, sensor: int, name: str) -> None:
    """Raises SceneError unless there is something to see, by something, in some light."""
    if not any(root.children_of("shape")):
        raise SceneError(f"{name} has no shapes: add one")
    alone = [e for e in root.children_of("emitter") if e.plugin != "area"]
    of_shapes = (e for s in root.children_of("shape") for e in s.walk())
    if not alone and not any(e.kind == "emitter" for e in of_shapes):
        raise SceneError(f"{name} has no emitter, so its image would be black: add one")
    around = [e for e in alone if e.plugin in ENVIRONMENTS]
    if len(around) > 1:
        raise SceneError(
            f"{around[1]} lights {name} from all around, as {around[0]} does: a scene can "
            "have one such emitter, remove the others"
        )
    sensors = list(root.children_of("sensor"))
    if not sensors:
        raise SceneError(f"{name} has no sensor: add one of type perspective")
    if not 0 <= sensor < len(sensors):
        raise SceneError(
            f"{name} has no sensor {sensor}: it has {len(sensors)}, counted from 0"
        )
    for film in sensors[sensor].children_of("film"):
        for name in ("width", "height", "crop_width", "crop_height"):
            size = film.properties.get(name, 1)
            if not isinstance(size, int) or size < 1:
                raise SceneError(f"{film} has {name} = {size}: it must be at least 1")


def check_transforms(used: list[Element]) -> None:
    """Raises SceneError for a to_world, of some elements, that is not finite or flattens
    what it moves."""
    moved = [e for e in used if e.properties.get("to_world") is not None]
    if moved:
        matrices = (e.properties["to_world"].matrix for e in moved)
        objects.check_all_invertible(objects.scalar_matrices(matrices, len(moved)), moved)


def check_files(parsed: parsing.ParsedScene, used: list[Element]) -> None:
    """Raises SceneError for images without pixels, and for mesh files whose indices would
    make Mitsuba crash, of the elements that are used."""
    checked = set()
    with parsing.resolving_by(parsed.resolver):
        for element in used:
            for name in ("bitmap", "data"):
                if name in element.properties and 0 in np.shape(element.properties[name]):
                    raise SceneError(f"{element} has a {name} of no pixels: give it some")
            filename = element.properties.get("filename")
            if filename is None:
                continue
            index = int(element.properties.get("shape_index", 0))
            path = parsing.resolved(str(filename))
            if element.kind in ("texture", "emitter"):
                check_image_file(path)
            elif element.kind == "shape" and (path, index) not in checked:
                checked.add((path, index))
                check_mesh_file(path, element.plugin, index)


def set_resolution(
    parsed: parsing.ParsedScene, sensor: int, resolution: tuple[int, int]
) -> None:
    """Changes the size of the chosen sensor's film before it is loaded."""
    chosen = list(parsed.root.children_of("sensor"))[sensor]
    for film in chosen.children_of("film"):
        if "crop_width" in film.properties or "crop_height" in film.properties:
            raise SceneError(
                f"{film} has a crop window, so its resolution cannot be changed: remove "
                "the crop"
            )
        number = next(n for n, e in enumerate(parsed.elements) if e is film)
        node = parsed.state.nodes[number]
        node.props["width"], node.props["height"] = resolution


def collect(
    scene: LoadedScene,
    names: dict[str, Element],
    sensor_number: int,
    resolution: tuple[int, int] | None,
    found: tuple[Feature, ...],
    lighting: Lighting,
    warnings: list[str],
) -> SceneArrays:
    """Copies a loaded scene into arrays; `names` gives elements by the ids of objects."""

    def name_of(instance: Any) -> str:
        element = names.get(instance.id())
        if element is None:
            element = Element(
                elements.kind_of(instance), objects.plugin_name(instance), instance.id()
            )
        return str(element)

    by_way = scene_objects.sorted_shapes(scene.shapes, scene.instances, scene.groups, names)
    shapes, sources, sensor = by_way.meshes, scene.emitters, scene.sensors[sensor_number]
    shape_names = [name_of(shape) for shape in shapes]
    geometry = meshes.gather(shapes, shape_names)
    framed = integrators.takes_bsdf_samples(found, lighting)
    materials = MaterialTable(mirrors=framed)
    firsts = zip(geometry.first_faces, geometry.first_vertices, strict=True)
    surfaces = [
        Surface(shape, name, *first)
        for shape, name, first in zip(shapes, shape_names, firsts, strict=True)
    ]
    rows = [materials.add(surface, names) for surface in surfaces]
    lights = [materials.add_light(surface, names) for surface in surfaces]
    textured = materials.uses_coordinates()
    coordinates = gather_coordinates(
        shapes,
        shape_names,
        [textured[row] or light != NONE for row, light in zip(rows, lights, strict=True)],
        geometry.first_vertices,
        framed,
    )
    others = scene_objects.gather_objects(
        by_way,
        len(geometry.faces),
        name_of,
        # Attributes of their meshes are refused, so that no numbers in the tree count.
        lambda shape: materials.add(Surface(shape, name_of(shape), 0, 0), names),
        lambda row: materials.uses_coordinates()[row],
        geometry.warnings,
        framed,
    )
    shape_of_emitter, emitter_of_shape = scene_objects.lights_of_shapes(
        by_way, others, sources
    )
    film, ignored = cameras.read_film(sensor.film(), name_of(sensor.film()))
    if resolution is not None:
        film = cameras.resized(film, resolution)
    source = sensor.sampler()
    element = names.get(source.id())
    sampler, base_seed = samplers.read_sampler(
        source, name_of(source), element.properties if element else {}
    )
    camera = cameras.read_camera(sensor, name_of(sensor))
    ignored += cameras.camera_warnings(camera, name_of(sensor))
    read = tuple(
        emitters.read_emitter(
            source,
            name_of(source),
            shape,
            meshes.rectangle_corners(geometry, shapes, shape),
            lights[shape]
            if shape < len(lights)
            else materials.add_picture(
                source, Surface(source, name_of(source), 0, 0), names
            ),
            names.get(source.id()),
        )
        for source, shape in zip(sources, shape_of_emitter, strict=True)
    )
    ignored += emitters.light_warnings(read, lighting.bsdf_samples)
    return SceneArrays(
        vertices=geometry.vertices,
        faces=geometry.faces,
        normals=geometry.normals,
        shapes=tuple(
            Shape(
                first_face=geometry.first_faces[number],
                face_count=geometry.face_counts[number],
                material=rows[number],
                emitter=emitter_of_shape.get(number, NONE),
                vertex_normals=geometry.vertex_normals[number],
                flip_normals=geometry.flip_normals[number],
                texture_coordinates=coordinates.present[number],
            )
            for number in range(len(shapes))
        ),
        materials=materials.array(),
        emitters=read,
        camera=camera,
        film=film,
        lighting=lighting,
        spp=int(source.sample_count()),
        base_seed=base_seed,
        features=found,
        warnings=tuple(
            dict.fromkeys([*warnings, *geometry.warnings, *coordinates.warnings, *ignored])
        ),
        shape_names=tuple(shape_names),
        not_finite_faces=tuple(geometry.dropped),
        textures=tuple(materials.textures.textures),
        material_textures=materials.texture_array(),
        material_passes=materials.passes(),
        speculars=materials.speculars(),
        material_speculars=materials.specular_numbers(),
        uvs=coordinates.uvs,
        sampler=sampler,
        environment=emitters.environment_of(sources, name_of),
        objects=scene_objects.with_lights(others, len(shapes), emitter_of_shape),
    )
