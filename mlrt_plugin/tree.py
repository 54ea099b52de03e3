"""A kd-tree over triangles for rays in NumPy or Dr.Jit arrays."""

from __future__ import annotations

import os
import warnings
from collections.abc import Collection
from pathlib import Path
from typing import Any, NamedTuple

import drjit as dr
import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .errors import MlrtWarning
from .options import BUILD_OPTIONS, TRACE_OPTIONS
from .tree_files import load_tree, save_tree
from .tree_report import tree_report

MAX_FACES = 2**30
"""Of a kd-tree, as in ``cpp/kdtree/events.h``."""


class Hits(NamedTuple):
    """Nearest hits of N rays.

    t: (N,) float32, in units of the ray's direction; inf for a miss.
    primitive: (N,) int32, the number of the face; -1 for a miss.
    u, v: (N,) float32, weights of the face's second and third vertex at the hit; 0 for a
    miss.
    """

    t: npt.NDArray[np.float32]
    primitive: npt.NDArray[np.int32]
    u: npt.NDArray[np.float32]
    v: npt.NDArray[np.float32]


class KdTree:
    """A kd-tree over the triangles of a mesh.

    Coordinates are kept in single precision: wider ones are rounded to it. Of hits at the
    same distance the one on the face of the lowest number counts, so that results do not
    depend on the options. Faces without area and faces with a vertex that is not finite
    are never hit. Queries release the GIL and use all threads of Dr.Jit's pool.
    """

    def __init__(
        self, vertices: npt.ArrayLike, faces: npt.ArrayLike, **options: Any
    ) -> None:
        """Builds the tree.

        vertices: (V, 3) coordinates.
        faces: (F, 3) integers, numbers of vertices.
        options: fields of `BuildOptions`, see `mlrt_plugin.options.BUILD_OPTIONS`.

        Warns of faces with a vertex that is not finite as MlrtWarning. Raises ValueError
        for arrays of another shape or type, and for a face that refers to a vertex that
        does not exist; TypeError for an unknown option.
        """
        points = triples(vertices, "vertices")
        corners = indices(faces, len(points))
        self._tree = core.KdTree(points, corners, **build_options(options))
        self._warn_of_dropped(points, corners)

    def _warn_of_dropped(
        self, points: npt.NDArray[np.float32], corners: npt.NDArray[np.uint32]
    ) -> None:
        if not self._tree.report["dropped_triangles"]:
            return
        bad: npt.NDArray[np.bool_] = np.any(~np.isfinite(points), axis=1)
        dropped = np.flatnonzero(bad[corners].any(axis=1))
        if dropped.size:
            warnings.warn(
                f"{dropped.size} of {len(corners)} faces have vertices with NaN or "
                "infinite coordinates in single precision and are left out, first of "
                f"them face {dropped[0]}, of vertices {corners[dropped[0]].tolist()}",
                MlrtWarning,
                stacklevel=3,
            )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the tree to a file, from which `load` gets it back; its faces are not
        stored. Builds all of a lazy tree first.

        The file is written under another name first, so that it is there as a whole or not
        at all. Raises TreeFileError if it cannot be written.
        """
        save_tree(self._tree, Path(path))

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        **options: Any,
    ) -> KdTree:
        """The tree that was saved to a file, as if it had been built from these arguments;
        a lazy tree comes finished.

        Raises TreeFileError if the file does not exist, is damaged, comes from another
        version, or holds the tree of other vertices, faces or options; and what
        building raises.
        """
        points = triples(vertices, "vertices")
        corners = indices(faces, len(points))
        tree = cls.__new__(cls)
        tree._tree = load_tree(Path(path), points, corners, build_options(options))
        tree._warn_of_dropped(points, corners)
        return tree

    @property
    def report(self) -> dict[str, Any]:
        """What the tree is like and what its builder did, see `tree_report`."""
        return tree_report(self._tree)

    def widen(self) -> int:
        """Makes the form of the tree for rays that go alone now: nodes of eight children
        and blocks of eight triangles. Otherwise it is made once so many rays without a
        common origin have come, or are given at once, that it saves the time which it
        takes; of a lazy tree, which this builds as a whole, never. Returns its bytes.

        Raises MemoryError if there is no room for it.
        """
        return int(self._tree.widen())

    def closest_hit(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_min: npt.ArrayLike = 0.0,
        t_max: npt.ArrayLike = np.inf,
        **options: Any,
    ) -> Hits:
        """The nearest hit of each ray {origin + t * direction, t_min < t <= t_max}.

        origins, directions: (N, 3); directions need not have unit length. Rays that follow
        one another should be near one another in space, or those of an image come line by
        line.
        t_min, t_max: numbers or (N,). What lies behind the origin is never hit: a negative
        t_min counts as 0.
        options: fields of `TraceOptions`, see `mlrt_plugin.options.TRACE_OPTIONS`; they
        change the time that is taken, never the result.

        A ray with a component that is not finite, with a direction of zero length, or with
        no t between its bounds, as where t_min exceeds t_max or one is NaN, misses. Raises
        ValueError for arrays of another shape or type.
        """
        rays = ray_arrays(origins, directions, t_min, t_max)
        t, primitive, u, v = self._tree.closest_hit(*rays, trace_options(options))
        return Hits(t, primitive, u, v)

    def any_hit(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_min: npt.ArrayLike = 0.0,
        t_max: npt.ArrayLike = np.inf,
        **options: Any,
    ) -> npt.NDArray[np.bool_]:
        """Whether anything lies on each ray: (N,) bool. Arguments are those of
        `closest_hit`."""
        rays = ray_arrays(origins, directions, t_min, t_max)
        occluded: npt.NDArray[np.uint8] = self._tree.any_hit(*rays, trace_options(options))
        return occluded.view(np.bool_)


def build_options(options: dict[str, Any]) -> dict[str, Any]:
    return known_options(options, BUILD_OPTIONS)


def trace_options(options: dict[str, Any]) -> dict[str, Any]:
    return known_options(options, TRACE_OPTIONS)


def known_options(options: dict[str, Any], known: Collection[str]) -> dict[str, Any]:
    unknown = sorted(set(options) - set(known))
    if unknown:
        raise TypeError(f"unknown option '{unknown[0]}': choose from {', '.join(known)}")
    return options


def as_numpy(values: Any, name: str) -> npt.NDArray[Any]:
    """An array of NumPy; nested Dr.Jit arrays such as ``mi.Point3f`` come as (N, 3)."""
    if np.ma.is_masked(values):
        raise ValueError(f"{name} must have no masked values: fill them or leave them out")
    try:
        array = np.asarray(values)
    except ValueError:
        # NumPy's sentence does not tell which argument has rows of different lengths.
        raise ValueError(f"{name} must be an array with rows of one length") from None
    if dr.is_array_v(values) and not dr.is_tensor_v(values) and dr.depth_v(values) == 2:
        return array.T
    return array


def single(array: npt.NDArray[Any], name: str) -> npt.NDArray[np.float32]:
    """The numbers of an array in single precision, contiguous."""
    if array.dtype.kind not in "fiu":
        raise ValueError(f"{name} must hold real numbers, not {array.dtype}")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, np.float32)


def triples(values: Any, name: str) -> npt.NDArray[np.float32]:
    """Points or vectors as (N, 3) float32."""
    array = as_numpy(values, name)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"{name} must have the shape (N, 3), not {array.shape}")
    return single(array, name)


def indices(values: Any, vertex_count: int) -> npt.NDArray[np.uint32]:
    """Faces as (F, 3) uint32."""
    array = as_numpy(values, "faces")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"faces must have the shape (F, 3), not {array.shape}")
    if array.dtype.kind not in "iu":
        raise ValueError(f"faces must hold integers, not {array.dtype}")
    if len(array) > MAX_FACES:
        raise ValueError(
            f"there are {len(array)} faces, more than a kd-tree can hold (2^30)"
        )
    if array.size:
        low, high = int(array.min()), int(array.max())
        if low < 0 or high >= vertex_count:
            worst = low if low < 0 else high
            raise ValueError(
                f"faces refer to vertex {worst}, but there are {vertex_count} vertices"
            )
    return np.ascontiguousarray(array, np.uint32)


def ray_arrays(
    origins: Any, directions: Any, t_min: Any, t_max: Any
) -> tuple[npt.NDArray[np.float32], ...]:
    """Rays as the native core takes them: (N, 3) and (N, 3), and both ends of their
    intervals as (N,), or as (1,) if all have the same, float32."""
    start, along = triples(origins, "origins"), triples(directions, "directions")
    if start.shape != along.shape:
        raise ValueError(
            f"origins and directions must have the same shape, not {start.shape} and "
            f"{along.shape}"
        )
    bounds = []
    for values, name in ((t_min, "t_min"), (t_max, "t_max")):
        array = as_numpy(values, name)
        if array.shape not in ((), (1,), (len(start),)):
            raise ValueError(
                f"{name} must be a number or have the shape ({len(start)},), not "
                f"{array.shape}"
            )
        bounds.append(single(array, name).reshape(-1))
    return start, along, bounds[0], bounds[1]
