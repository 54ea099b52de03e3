"""The core's object set of a scene, and rays against all that the scene holds."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .object_arrays import ObjectArrays
from .scene_arrays import Vec3
from .shape_arrays import Shape
from .tree import ray_arrays, trace_options
from .tree_cache import obtain_tree


class SceneHits(NamedTuple):
    """Nearest hits of N rays among all shapes of a scene.

    t: (N,) float32, in units of the ray's direction; inf for a miss.
    shape: (N,) int32, number of the shape; face: (N,) int32, number of the face in it, 0
    for a sphere, disk or cylinder; instance: (N,) int32, number of the instance; each -1
    for none. Of an instance, the shape is that of its group.
    u, v: (N,) float32, weights of a triangle's second and third vertex; of a disk the place
    in its own frame; else 0.
    """

    t: npt.NDArray[np.float32]
    shape: npt.NDArray[np.int32]
    face: npt.NDArray[np.int32]
    instance: npt.NDArray[np.int32]
    u: npt.NDArray[np.float32]
    v: npt.NDArray[np.float32]


@dataclass(frozen=True)
class ObtainedObjects:
    """An object set of the core, None for a scene without objects, and how it came about;
    see `ObtainedTree`."""

    handle: Any = None
    timings: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def obtain_objects(
    arrays: ObjectArrays | None,
    first_face: int,
    options: Mapping[str, Any],
    cache: str | os.PathLike[str] | None,
) -> ObtainedObjects:
    """The object set of a scene; arguments as of `obtain_tree`, which makes a tree for each
    group. first_face: how many faces the scene's tree has."""
    if arrays is None:
        return ObtainedObjects()
    timings: dict[str, float] = {}
    warnings: list[str] = []
    groups = []
    for group in arrays.groups:
        tree = None
        if len(group.faces):
            obtained = obtain_tree(group.vertices, group.faces, options, cache)
            tree = obtained.tree
            warnings += obtained.warnings
            add_timings(timings, obtained.timings)
        has_vertices = len(group.normals) > 0 or len(group.uvs) > 0
        groups.append(
            {
                "tree": tree,
                "faces": group.faces if has_vertices else group.faces[:0],
                "normals": group.normals,
                "uvs": group.uvs,
                "analytic_count": group.analytic_count,
            }
        )
    handle = core.Objects(
        arrays.analytic_types,
        arrays.analytic_frames,
        arrays.scene_analytic_count,
        groups,
        arrays.instance_groups,
        arrays.instance_maps,
        arrays.instance_normals,
        first_face,
    )
    return ObtainedObjects(handle, timings, tuple(dict.fromkeys(warnings)))


def add_timings(total: dict[str, float], more: Mapping[str, float]) -> None:
    """Adds seconds up by name, in place."""
    for name, seconds in more.items():
        total[name] = total.get(name, 0.0) + seconds


def common_bounds(tree: Any, objects: Any) -> tuple[Vec3, Vec3]:
    """Corners of a box around a tree of the core and an object set, which may be None."""
    low, high = tree.bounds
    if objects is None:
        return low, high
    other_low, other_high = objects.bounds
    return (
        tuple(np.fmin(low, other_low).tolist()),
        tuple(np.fmax(high, other_high).tolist()),
    )


def scene_hits(
    tree: Any, objects: Any, shapes: tuple[Shape, ...], rays: Any, options: dict[str, Any]
) -> SceneHits:
    """The nearest hits of rays, as `ray_arrays` gives them.

    tree, objects: of the core; objects may be None. shapes: of all of the scene.
    """
    trace = trace_options(options)
    if objects is None:
        t, face, u, v = tree.closest_hit(*rays, trace)
        instance = np.full(len(face), -1, np.int32)
    else:
        t, face, instance, u, v = objects.closest_hit(tree, *rays, trace)
    first = np.array([shape.first_face for shape in shapes], np.int64)
    number = face.view(np.uint32).astype(np.int64)
    hit = number != 0xFFFFFFFF
    # Of shapes that begin at the same face, all but the last have none.
    shape = np.where(hit, np.searchsorted(first, number, side="right") - 1, -1)
    own = np.where(hit, number - first[shape], -1)
    return SceneHits(t, shape.astype(np.int32), own.astype(np.int32), instance, u, v)


class RayQueries:
    """Rays against all shapes of a scene, for a class that has its tree and its objects, of
    the core; objects may be None."""

    tree: Any
    objects: Any

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """All shapes, by the numbers that `closest_hit` gives."""
        raise NotImplementedError

    def closest_hit(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_min: npt.ArrayLike = 0.0,
        t_max: npt.ArrayLike = np.inf,
        **options: Any,
    ) -> SceneHits:
        """The nearest hit of each ray on any shape of the scene; arguments are those of
        `KdTree.closest_hit`."""
        rays = ray_arrays(origins, directions, t_min, t_max)
        return scene_hits(self.tree, self.objects, self.shapes, rays, options)

    def any_hit(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_min: npt.ArrayLike = 0.0,
        t_max: npt.ArrayLike = np.inf,
        **options: Any,
    ) -> npt.NDArray[np.bool_]:
        """Whether any shape of the scene lies on each ray: (N,) bool."""
        rays = ray_arrays(origins, directions, t_min, t_max)
        if self.objects is None:
            found = self.tree.any_hit(*rays, trace_options(options))
        else:
            found = self.objects.any_hit(self.tree, *rays, trace_options(options))
        return np.asarray(found).view(np.bool_)
