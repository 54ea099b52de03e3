"""What rays can hit: the meshes of a scene by the kd-tree, its other shapes by Mitsuba.

Shapes that are not triangle meshes (spheres, disks, cylinders, curves, instances) stay in a
scene of their own, which Mitsuba intersects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import numpy.typing as npt

from .. import meshes
from .. import mitsuba_objects as objects
from ..tree import trace_options


@dataclass(frozen=True)
class MeshFaces:
    """The faces of all meshes of a scene, one after the other, and where each came from.

    shape_of_face: (F,) UInt32, number of the shape.
    first_face: (S,) UInt32, number of a shape's first face; 0 for a shape that is no mesh.
    """

    geometry: meshes.Geometry
    shape_of_face: Any
    first_face: Any
    mesh_count: int


def is_triangle_mesh(shape: Any) -> bool:
    """Whether a shape is a mesh that rays hit on both sides of its faces."""
    # An ellipsoid mesh is hit on one side only.
    return bool(shape.is_mesh()) and objects.plugin_name(shape) != "EllipsoidsMesh"


def mesh_faces(shapes: list[Any], names: list[str]) -> MeshFaces | None:
    """Gathers the meshes among loaded shapes; `names` tell these apart in messages.

    None if there is no mesh. Raises SceneError as `meshes.gather` does.
    """
    numbers = [n for n, shape in enumerate(shapes) if is_triangle_mesh(shape)]
    if not numbers:
        return None
    geometry = meshes.gather([shapes[n] for n in numbers], [names[n] for n in numbers])
    first_face = np.zeros(len(shapes), np.uint32)
    first_face[numbers] = geometry.first_faces
    shape_of_face = np.repeat(np.array(numbers, np.uint32), geometry.face_counts)
    module = objects.variant_module(shapes[numbers[0]])
    return MeshFaces(
        geometry, module.UInt32(shape_of_face), module.UInt32(first_face), len(numbers)
    )


def other_shapes(shapes: list[Any], groups: list[Any]) -> Any:
    """A scene of those shapes that are no triangle meshes; None if there is none.

    groups: what instances among the shapes refer to.
    """
    others = [shape for shape in shapes if not is_triangle_mesh(shape)]
    if not others:
        return None
    properties = mi.Properties("scene")
    for number, shape in enumerate((*groups, *others)):
        properties[f"shape_{number}"] = shape
    return objects.variant_module(others[0]).Scene(properties)


def copied(kind: type, values: npt.NDArray[Any]) -> Any:
    """A Dr.Jit array of numbers in memory of its own.

    Dr.Jit would go on using the memory of NumPy, and compile a kernel anew where that is
    aligned in another way.
    """
    array: Any = dr.empty(kind, len(values))
    np.copyto(array.numpy(), values)
    return array


class HitScene:
    """Answers rays of Mitsuba's type, in one wavefront each, on which kernels are run."""

    def __init__(
        self,
        shapes: list[Any],
        tree: Any,
        faces: MeshFaces | None,
        others: Any,
        options: Mapping[str, Any],
    ) -> None:
        """shapes: loaded in `llvm_ad_rgb`. tree: of `faces`, a tree of the core; both are
        None if there is no mesh. others: what `other_shapes` gives. options: of
        `TraceOptions`.
        """
        self._module = objects.variant_module(shapes[0])
        self._shapes = self._module.ShapePtr(shapes)
        self._tree = tree
        self._faces = faces
        self._others = others
        self._options = trace_options(dict(options))

    def closest_hit(self, ray: Any, active: Any) -> tuple[Any, Any]:
        """The nearest hit of each ray as a PreliminaryIntersection3f, and for the hits on
        meshes the number of the face among all of the scene, -1 elsewhere."""
        module = self._module
        pi = dr.zeros(module.PreliminaryIntersection3f, dr.width(ray, active))
        pi.t = dr.full(module.Float, dr.inf, dr.width(pi))
        face = dr.full(module.Int32, -1, dr.width(pi))
        if self._faces is not None:
            rays = self._rays(ray, active)
            t, primitive, u, v = self._tree.closest_hit(*rays, self._options)
            face = copied(module.Int32, primitive.view(np.int32))
            pi.valid = face >= 0
            pi.t = copied(module.Float, t)
            pi.prim_uv = module.Point2f(copied(module.Float, u), copied(module.Float, v))
            number = module.UInt32(face)
            shape = dr.gather(module.UInt32, self._faces.shape_of_face, number, pi.valid)
            pi.shape_index = shape
            pi.shape = dr.gather(module.ShapePtr, self._shapes, shape, pi.valid)
            pi.prim_index = number - dr.gather(
                module.UInt32, self._faces.first_face, shape, pi.valid
            )
        if self._others is not None:
            shorter = module.Ray3f(ray)
            shorter.maxt = dr.minimum(ray.maxt, pi.t)
            other = self._others.ray_intersect_preliminary(shorter, True, active)
            nearer = other.is_valid() & active
            pi = dr.select(nearer, other, pi)
            face = dr.select(nearer, -1, face)
        return pi, face

    def any_hit(self, ray: Any, active: Any) -> Any:
        """Whether something lies on each ray, a Bool; False where it is not active."""
        module = self._module
        occluded = dr.full(module.Bool, False, dr.width(ray, active))
        if self._faces is not None:
            found = self._tree.any_hit(*self._rays(ray, active), self._options)
            occluded = copied(module.Bool, found.view(np.bool_))
        if self._others is not None:
            occluded |= self._others.ray_test(ray, False, active & ~occluded)
        return occluded & active

    def _rays(self, ray: Any, active: Any) -> tuple[Any, ...]:
        """Rays as the core takes them; those that are not active can hit nothing."""
        module = self._module
        count = dr.width(ray, active)
        origin: Any = dr.ravel(ray.o)
        along: Any = dr.ravel(ray.d)
        end: Any = dr.select(active, ray.maxt, 0) + dr.zeros(module.Float, count)
        dr.eval(origin, along, end)
        points, directions = (
            np.ascontiguousarray(np.broadcast_to(a.numpy().reshape(-1, 3), (count, 3)))
            for a in (origin, along)
        )
        return points, directions, np.zeros(count, np.float32), end.numpy()
