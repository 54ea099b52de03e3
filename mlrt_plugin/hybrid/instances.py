"""Instances of meshes, written out: one mesh holds all copies of a mesh of a group.

The tree holds triangles, and Mitsuba's llvm variants compile code for each instance, which
takes about a quarter of a second apiece.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt

from .. import mitsuba_objects as objects
from ..elements import Element
from ..errors import UnsupportedFeature
from ..mesh_repair import check_mesh
from .hit_scene import is_triangle_mesh

LARGEST_FACE_COUNT = 50_000_000
"""Of all copies together; chosen: they take some ten gigabytes with their tree."""
LARGEST_INSTANCE_COUNT = 100
"""Of instances that cannot be written out; chosen: half a minute of compiling."""
OWN_BUFFERS = ("vertex_positions", "vertex_normals", "vertex_texcoords", "faces")


@dataclass(frozen=True)
class Transform:
    """What an instance does to points, (4, 4), and to normals, (3, 3).

    Mitsuba keeps both, and they do not belong together where a scene rotates about an axis
    that is not of unit length; its image is that of what it keeps.
    """

    points: npt.NDArray[np.float64]
    normals: npt.NDArray[np.float64]

    @staticmethod
    def of(to_world: Any) -> Transform:
        """Of a property of a scene; None leaves things in place."""
        if to_world is None:
            return Transform(np.eye(4), np.eye(3))
        inverse_transpose = np.array(to_world.inverse_transpose, np.float64)
        return Transform(objects.matrix(to_world), inverse_transpose.reshape(4, 4)[:3, :3])


def without_instances(
    parts: list[Any],
    instances: list[Element],
    elements: Mapping[str, Element],
    children: Mapping[str, list[Any]],
) -> list[Any]:
    """The parts of a scene with instances of meshes replaced by meshes, which follow the
    other parts.

    parts: objects in the order of declaration. instances: what the scene says of them,
    whether they are among the parts or not. elements: by the ids of objects. children: the
    shapes of each group, by its id.

    Groups that hold other shapes as well stay. Raises UnsupportedFeature for more faces, or
    more instances that stay, than can be dealt with.
    """
    by_element = {id(element): id_ for id_, element in elements.items()}
    transforms: dict[str, list[Transform]] = {}
    written_out = set()
    for element in instances:
        groups = [by_element[id(child)] for _, child in element.children]
        if len(groups) != 1 or not can_be_written_out(children.get(groups[0], [])):
            continue
        written_out.add(by_element[id(element)])
        transform = Transform.of(element.properties.get("to_world"))
        transforms.setdefault(groups[0], []).append(transform)
    check_counts(transforms, children)
    result = [p for p in parts if p.id() not in written_out and p.id() not in transforms]
    check_instances(sum(part.class_name() == "Instance" for part in result))
    for group, own in transforms.items():
        name = str(elements[group])
        result += [copies(mesh, own, name) for mesh in children[group]]
    return result


def can_be_written_out(shapes: list[Any]) -> bool:
    return bool(shapes) and all(is_triangle_mesh(shape) for shape in shapes)


def check_counts(
    transforms: Mapping[str, list[Any]], children: Mapping[str, list[Any]]
) -> None:
    """Raises UnsupportedFeature for copies that are too large together."""
    faces = sum(
        len(matrices) * sum(mesh.face_count() for mesh in children[group])
        for group, matrices in transforms.items()
    )
    if faces > LARGEST_FACE_COUNT:
        count = sum(len(matrices) for matrices in transforms.values())
        raise UnsupportedFeature(
            f"the scene has {count} instances with {faces} faces in all, and they "
            f"are written out: keep to {LARGEST_FACE_COUNT} faces"
        )


def check_instances(count: int) -> None:
    """Raises UnsupportedFeature for more instances than Mitsuba can deal with."""
    if count > LARGEST_INSTANCE_COUNT:
        raise UnsupportedFeature(
            f"the scene has {count} instances that cannot be written out as meshes, and "
            "Mitsuba compiles code for each of them: keep to "
            f"{LARGEST_INSTANCE_COUNT}, or to groups of triangle meshes"
        )


def copies(mesh: Any, transforms: list[Transform], name: str) -> Any:
    """One mesh with a copy of `mesh` for each transformation.

    name: of the group, for messages. Raises SceneError for a mesh that is broken.
    """
    module = objects.variant_module(mesh)
    count = len(transforms)
    to_world = np.stack([transform.points for transform in transforms])
    points = np.array(mesh.vertex_positions_buffer(), np.float64).reshape(-1, 3)
    corners = np.array(mesh.faces_buffer(), np.uint32).reshape(-1, 3)
    check_mesh(len(points), corners, name)
    linear = to_world[:, :3, :3]
    moved = np.einsum("kij,vj->kvi", linear, points) + to_world[:, None, :3, 3]
    faces = np.repeat(corners[None], count, axis=0)
    # Mitsuba transforms the normals of instances, and a mirrored face would turn its own.
    mirrored = np.linalg.det(linear) < 0
    faces[mirrored] = faces[mirrored][:, :, [0, 2, 1]]
    faces += (np.arange(count, dtype=np.uint32) * np.uint32(len(points)))[:, None, None]

    properties = mi.Properties()
    properties["bsdf"] = mesh.bsdf()
    properties["flip_normals"] = bool(mesh.has_flipped_normals())
    properties["face_normals"] = bool(mesh.has_face_normals())
    smooth = mesh.has_vertex_normals() and objects.plugin_name(mesh) != "rectangle"
    result = module.Mesh(
        mesh.id(),
        len(points) * count,
        len(corners) * count,
        properties,
        has_vertex_normals=smooth,
        has_vertex_texcoords=mesh.has_vertex_texcoords(),
    )
    values: dict[str, npt.NDArray[Any]] = {"vertex_positions": moved, "faces": faces}
    if smooth:
        normals = np.array(mesh.vertex_normals_buffer(), np.float64).reshape(-1, 3)
        # Of any length: they are interpolated before they are normalised.
        turn = np.stack([transform.normals for transform in transforms])
        values["vertex_normals"] = np.einsum("kij,vj->kvi", turn, normals)
    if mesh.has_vertex_texcoords():
        values["vertex_texcoords"] = np.tile(
            np.array(mesh.vertex_texcoords_buffer()), count
        )
    types = {name: np.float32 for name in values} | {"faces": np.uint32}
    objects.set_members(
        result,
        {
            name: np.ascontiguousarray(value, types[name]).reshape(-1)
            for name, value in values.items()
        },
    )
    for key, value in objects.members(mesh).items():
        if key.startswith(("vertex_", "face_")) and key not in OWN_BUFFERS:
            own = np.tile(np.array(value, np.float32), count)
            size = len(np.array(value)) // (
                len(points) if key.startswith("vertex_") else len(corners)
            )
            result.add_attribute(key, size, own)
    result.set_id(mesh.id())
    return result
