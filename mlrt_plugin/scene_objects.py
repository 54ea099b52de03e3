"""Analytic shapes, groups and instances of a loaded scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from . import elements, meshes, parsing
from . import mitsuba_objects as objects
from .elements import Element
from .errors import SceneError
from .features import MESHES
from .object_arrays import ANALYTIC_TYPES, GroupArrays, ObjectArrays
from .shape_arrays import NONE, Shape
from .texture_coordinates import gather_coordinates

GROUP = "ShapeGroupPlugin"
INSTANCE = "Instance"
"""Mitsuba's classes of the plugins `shapegroup` and `instance`."""
ROUND_ENOUGH = 1e-3
"""How much two axes of a sphere may differ, relatively; chosen."""


@dataclass
class SortedShapes:
    """The shapes of a scene by the way rays meet them, in the order of declaration.

    instances: what the scene says of them, with the id of their group each. groups: the
    shapes of each group that has an instance, by its id, in the order in which they are
    referred to.
    """

    meshes: list[Any] = field(default_factory=list)
    analytic: list[Any] = field(default_factory=list)
    instances: list[tuple[Element, str]] = field(default_factory=list)
    groups: dict[str, list[Any]] = field(default_factory=dict)


def is_analytic(shape: Any) -> bool:
    """Whether a loaded shape is met as it is, without triangles."""
    return objects.plugin_name(shape) in ANALYTIC_TYPES


def sorted_shapes(
    shapes: list[Any],
    instances: list[Element],
    children: Mapping[str, list[Any]],
    names: Mapping[str, Element],
) -> SortedShapes:
    """Sorts loaded shapes.

    instances: see `instances_of`. children: the shapes of each group, by its id. names:
    elements by the ids of objects.
    """
    ids = {id(element): id_ for id_, element in names.items()}
    result = SortedShapes()
    for shape in shapes:
        if is_analytic(shape):
            result.analytic.append(shape)
        elif shape.class_name() not in (GROUP, INSTANCE):
            result.meshes.append(shape)
    for element in instances:
        (group,) = (ids[id(child)] for _, child in element.children)
        result.instances.append((element, group))
        result.groups.setdefault(group, children[group])
    return result


def instances_of(parsed: parsing.ParsedScene) -> list[Element]:
    """What a scene says of its instances, in the order of declaration."""
    return [e for e in parsed.root.children_of("shape") if e.plugin == "instance"]


def plain_instances(parsed: parsing.ParsedScene, of_meshes_only: bool = False) -> list[str]:
    """Names, in the scene, of instances of which all is known without loading them: they
    move a group that the scene declares, and say nothing else.

    Mitsuba would take a tenth of a millisecond for each in an llvm variant, and much more
    once they are in a scene. of_meshes_only: only instances of groups of triangle meshes.
    """
    groups = {
        id(child)
        for child in parsed.root.children_of("shape")
        if child.plugin == "shapegroup"
        and (not of_meshes_only or all(c.plugin in MESHES for _, c in child.children))
    }
    return [
        name
        for name, child in parsed.root.children
        if child.plugin == "instance"
        and child.properties.keys() <= {"to_world"}
        and [id(group) in groups for _, group in child.children] == [True]
    ]


def group_children(
    parsed: parsing.ParsedScene, names: Mapping[str, Element]
) -> dict[str, list[Any]]:
    """The loaded shapes of each group of a scene, by its id.

    names: elements by the ids of objects, as `parsing.instantiate` gives them.
    """
    all_nodes = list(parsed.state.nodes)
    nodes = {
        id_: all_nodes[int(id_[1:])]
        for id_, element in names.items()
        if element.plugin == "shapegroup"
    }
    return {
        id_: [o for _, o in node.props.objects() if elements.kind_of(o) == "shape"]
        for id_, node in nodes.items()
    }


def gather_objects(
    scene: SortedShapes,
    first_face: int,
    name_of: Callable[[Any], str],
    material_of: Callable[[Any], int],
    uses_coordinates: Callable[[int], bool],
    warnings: list[str],
    with_coordinates: bool = False,
) -> ObjectArrays | None:
    """Copies what is not in the tree out of loaded shapes; None if there is nothing.

    first_face: how many faces the tree has. name_of: what messages call a shape.
    material_of: the number of a shape's material. uses_coordinates: whether a material
    needs texture coordinates. warnings: grows by a sentence on each thing that is
    approximated. with_coordinates: whether those of all meshes are needed.

    Raises SceneError for a shape without an extent and for a mesh that is broken.
    """
    if not scene.analytic and not scene.instances:
        return None
    shapes: list[Shape] = []
    shape_names: list[str] = []
    groups: list[GroupArrays] = []
    analytic = list(scene.analytic)
    for children in scene.groups.values():
        own = [shape for shape in children if not is_analytic(shape)]
        own_names = [name_of(shape) for shape in own]
        geometry = meshes.gather(own, own_names)
        warnings += geometry.warnings
        rows = [material_of(shape) for shape in own]
        coordinates = gather_coordinates(
            own,
            own_names,
            [uses_coordinates(row) for row in rows],
            geometry.first_vertices,
            with_coordinates,
        )
        warnings += coordinates.warnings
        groups.append(
            GroupArrays(
                geometry.vertices,
                geometry.faces,
                geometry.normals,
                coordinates.uvs,
                len(children) - len(own),
            )
        )
        analytic += [shape for shape in children if is_analytic(shape)]
        for number, row in enumerate(rows):
            shapes.append(
                Shape(
                    first_face=first_face + geometry.first_faces[number],
                    face_count=geometry.face_counts[number],
                    material=row,
                    vertex_normals=geometry.vertex_normals[number],
                    flip_normals=geometry.flip_normals[number],
                    texture_coordinates=coordinates.present[number],
                )
            )
        shape_names += own_names
        first_face += len(geometry.faces)
    frames = np.zeros((len(analytic), 3, 4))
    types = np.zeros(len(analytic), np.uint32)
    for number, shape in enumerate(analytic):
        name = name_of(shape)
        types[number] = ANALYTIC_TYPES.index(objects.plugin_name(shape))
        frames[number] = frame_of(shape, name, warnings)
        shapes.append(
            Shape(
                first_face=first_face + number,
                face_count=1,
                material=material_of(shape),
                flip_normals=bool(shape.has_flipped_normals()),
            )
        )
        shape_names.append(name)
    numbers = {group: number for number, group in enumerate(scene.groups)}
    maps, normals = placements([element for element, _ in scene.instances])
    return ObjectArrays(
        shapes=tuple(shapes),
        shape_names=tuple(shape_names),
        analytic_types=types,
        analytic_frames=frames,
        scene_analytic_count=len(scene.analytic),
        groups=tuple(groups),
        instance_groups=np.array([numbers[g] for _, g in scene.instances], np.uint32),
        instance_maps=maps,
        instance_normals=normals,
    )


def frame_of(shape: Any, name: str, warnings: list[str]) -> npt.NDArray[np.float64]:
    """(3, 4) matrix from the frame of an analytic shape, in which its size is one."""
    frame = objects.matrix(objects.members(shape)["to_world"])[:3]
    sizes = np.linalg.norm(frame[:, :3], axis=0)
    finite = np.isfinite(frame).all()
    if not finite or abs(np.linalg.det(frame[:, :3])) <= 1e-12 * np.prod(sizes):
        raise SceneError(
            f"{name} has no extent, or no place: its radius, the way from p0 to p1 and the "
            "scales of its to_world must be finite and must not be 0"
        )
    if objects.plugin_name(shape) == "sphere":
        stretch = np.linalg.svd(frame[:, :3], compute_uv=False)
        if stretch[0] - stretch[2] > ROUND_ENOUGH * stretch[0]:
            warnings.append(
                f"{name} has a to_world that makes it an ellipsoid: it is rendered as a "
                f"sphere of radius {sizes[0]:g}, as in Mitsuba"
            )
    return frame


def placements(
    instances: list[Element],
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(I, 3, 4) maps of points to the world and (I, 3, 3) maps of normals.

    Mitsuba keeps both, and they do not belong together where a scene rotates about an axis
    that is not of unit length; its image is that of what it keeps. Raises SceneError for a
    map that is not finite or flattens the instance.
    """
    maps = np.tile(np.eye(3, 4), (len(instances), 1, 1))
    normals = np.tile(np.eye(3), (len(instances), 1, 1))
    moves: dict[int, Any] = {
        number: instance.properties["to_world"]
        for number, instance in enumerate(instances)
        if instance.properties.get("to_world") is not None
    }
    rows, count = list(moves), len(moves)
    matrices = (to_world.matrix for to_world in moves.values())
    to_worlds = objects.scalar_matrices(matrices, count)
    objects.check_all_invertible(to_worlds, [instances[row] for row in rows])
    maps[rows] = to_worlds[:, :3]
    matrices = (to_world.inverse_transpose for to_world in moves.values())
    normals[rows] = objects.scalar_matrices(matrices, count)[:, :3, :3]
    return maps, normals


def lights_of_shapes(
    by_way: SortedShapes, others: ObjectArrays | None, sources: list[Any]
) -> tuple[list[int], dict[int, int]]:
    """The number of the shape that each emitter is on, NONE for none, and the number of the
    emitter of each shape that glows. Shapes are numbered as the core does: meshes, then
    those of `others`."""
    glowing = {}
    for number, shape in enumerate(by_way.meshes):
        if shape.emitter() is not None:
            glowing[number] = shape.emitter()
    if others is not None:
        first = len(by_way.meshes) + len(others.shapes) - len(others.analytic_types)
        for number, shape in enumerate(by_way.analytic):
            if shape.emitter() is not None:
                glowing[first + number] = shape.emitter()
    shape_of_emitter = [NONE] * len(sources)
    emitter_of_shape = {}
    for number, own in glowing.items():
        for index, source in enumerate(sources):
            if own is source:
                emitter_of_shape[number], shape_of_emitter[index] = index, number
    return shape_of_emitter, emitter_of_shape


def with_lights(
    others: ObjectArrays | None, first: int, emitter_of_shape: Mapping[int, int]
) -> ObjectArrays | None:
    """Objects whose shapes know their emitters; `first` is the number of the first."""
    if others is None:
        return None
    shapes = tuple(
        replace(shape, emitter=emitter_of_shape.get(first + number, NONE))
        for number, shape in enumerate(others.shapes)
    )
    return replace(others, shapes=shapes)
