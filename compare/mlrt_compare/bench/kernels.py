"""What exactness costs and gives: the same traversal with usual tests of triangles beside
the exact one, each way through the tree with the exact one, and Embree in its default and
its robust mode."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin import KdTree

from .exact_hits import exact_distances
from .hit_contenders import HitContender, embree_contenders
from .native import Native
from .offset_scene import ball
from .wrong_hits import FAR_OFF

FloatArray = npt.NDArray[np.float32]
HitArrays = tuple[FloatArray, npt.NDArray[np.int64]]
"""Distances (N,), inf for a miss, and faces (N,), -1 for one."""
MISS = 0xFFFFFFFF
KERNELS = {
    "single": "single precision",
    "double": "double precision",
    "pluecker": "Plücker, single precision",
    "sheared": "sheared, single precision",
    "exact": "exact",
}
"""Tests of triangles that kernels.h tells of."""
USUAL = "MLRT as usual"
TRAVERSALS: dict[str, dict[str, Any]] = {
    "single rays": {"traversal": "single", "entry_points": False},
    "wide tree": {"traversal": "wide"},
    "packets": {"traversal": "packet", "entry_points": False},
    "packets, entry points": {"traversal": "packet"},
    "intervals": {"traversal": "interval", "entry_points": False},
    "intervals, entry points": {"traversal": "interval"},
    "beams": {"traversal": "beam_leaf"},
}
"""Options of the tracer, with the exact test."""
COHERENT = ("intervals", "intervals, entry points", "beams")
"""Of these those that take forever for rays that have little in common."""
EXACT = (KERNELS["exact"], USUAL, *TRAVERSALS)
"""Contenders that must not lose a ray."""
AIMS = ("vertices", "points of edges", "anywhere", "pixels")
ORIGINS = 64
"""Points that rays start at; neighbours in a row share one."""
RUN = 1024


@dataclass(frozen=True)
class Contender:
    """Called with origins and directions, (N, 3) float32; returns seconds of wall-clock
    time too."""

    name: str
    closest_hit: Callable[[FloatArray, FloatArray], tuple[HitArrays, float]]


def kernel_contenders(
    native: Native, vertices: FloatArray, faces: npt.NDArray[np.uint32], threads: int
) -> list[Contender]:
    """The kernels walk the tree of the fast builder in packets of 16 from the root. Then
    come MLRT as it traces by default and in each other way, and Embree, whose seconds, as
    MLRT's, include that rays are read and hits are written as arrays."""
    mesh = native.module.Mesh(vertices, faces)
    tree = native.module.KdTree(mesh, {"builder": "fast"})

    def by_kernel(kernel: str) -> Contender:
        def closest_hit(o: FloatArray, d: FloatArray) -> tuple[HitArrays, float]:
            t, face = np.empty(len(o), np.float32), np.empty(len(o), np.uint32)
            seconds: Any = tree.trace_with(kernel, o, d, t, face)
            return (t, np.where(face == MISS, -1, face.astype(np.int64))), seconds.wall

        return Contender(KERNELS[kernel], closest_hit)

    own = KdTree(vertices, faces, builder="fast")

    def by_traversal(name: str, options: dict[str, Any]) -> Contender:
        def closest_hit(o: FloatArray, d: FloatArray) -> tuple[HitArrays, float]:
            start = time.perf_counter()
            hits = own.closest_hit(o, d, **options)
            seconds = time.perf_counter() - start
            return (hits.t, hits.primitive.astype(np.int64)), seconds

        return Contender(name, closest_hit)

    def timed(embree: HitContender) -> Contender:
        def closest_hit(o: FloatArray, d: FloatArray) -> tuple[HitArrays, float]:
            start = time.perf_counter()
            hits = embree.closest_hit(o, d)
            return hits, time.perf_counter() - start

        return Contender(embree.name, closest_hit)

    return [
        *(by_kernel(kernel) for kernel in KERNELS),
        by_traversal(USUAL, {}),
        *(by_traversal(name, options) for name, options in TRAVERSALS.items()),
        *map(timed, embree_contenders(native, mesh, threads)),
    ]


@dataclass(frozen=True)
class ClosedMesh:
    name: str
    vertices: FloatArray
    faces: npt.NDArray[np.uint32]
    center: npt.NDArray[np.float64]
    inner: int
    """Faces that rays meet first, and are aimed at; others, if any, lie behind them."""


def closed_meshes(subdivisions: int) -> list[ClosedMesh]:
    """A ball, the same squeezed until its faces are slivers, one far from the origin, and
    one within another: what leaks out of the inner one is a wrong hit of the outer one."""
    one = ball(np.zeros(3), 1.0, subdivisions)
    two = np.concatenate([one, ball(np.zeros(3), 2.0, subdivisions)])
    meshes = []
    for name, triangles, factors, center in (
        ("ball", one, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),
        ("slivers", one, (1.0, 1.0, 1e-3), (0.0, 0.0, 0.0)),
        ("ball at 10^4", one, (1.0, 1.0, 1.0), (1e4, -1e4, 1e4)),
        ("ball in a ball", two, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)),
    ):
        corners = (triangles * factors + center).astype(np.float32).reshape(-1, 3)
        # Corners that are rounded alike are one vertex.
        vertices, numbers = np.unique(corners, axis=0, return_inverse=True)
        faces = numbers.reshape(-1, 3).astype(np.uint32)
        meshes.append(ClosedMesh(name, vertices, faces, np.array(center), len(one)))
    return meshes


def rays_inside(
    mesh: ClosedMesh, aim: str, count: int, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Rays from inside, every one of which meets a face: at random, but for those at
    pixels, which are of a square image in blocks of 4 x 4."""
    rng = np.random.default_rng(seed)
    aimed = mesh.faces[: mesh.inner]
    size = 0.2 * np.ptp(mesh.vertices[aimed.ravel()], axis=0)
    points = mesh.center + rng.uniform(-0.5, 0.5, (ORIGINS, 3)) * size
    runs = rng.integers(0, ORIGINS, -(-count // RUN))
    origins = points.astype(np.float32)[np.repeat(runs, RUN)[:count]]
    if aim == "pixels":
        return np.repeat(origins[:1], count, axis=0), through_pixels(count)
    if aim == "anywhere":
        return origins, rng.normal(size=(count, 3)).astype(np.float32)
    corners = mesh.vertices[aimed[rng.integers(0, len(aimed), count)]]
    target = corners[:, 0]
    if aim == "points of edges":
        share = rng.uniform(size=(count, 1))
        target = (target + share * (corners[:, 1].astype(np.float64) - target)).astype("f4")
    return origins, target - origins


def through_pixels(count: int) -> FloatArray:
    """Directions of a camera that looks along x with 90 degrees of view, row of blocks by
    row of blocks."""
    blocks = int(np.ceil(np.sqrt(count / 16)))
    number = np.arange(count)
    block, inside = number // 16, number % 16
    column = block % blocks * 4 + inside % 4
    row = block // blocks * 4 + inside // 4
    y, z = ((2 * place + 1) / (4 * blocks) - 1 for place in (column, row))
    return np.stack([np.ones(count), y, z], axis=1).astype(np.float32)


def compare(
    mesh: ClosedMesh,
    contenders: list[Contender],
    origins: FloatArray,
    directions: FloatArray,
    repeats: int,
) -> list[dict[str, Any]]:
    """Leaks, which are rays that find nothing; hits of other faces than the exact one's, of
    which most tie with it; wrong ones of these, and those of them that are far off, which
    are no neighbours; leaks and wrong hits of a billion rays; errors of t in units in the
    last place where the face is the same; and rays a second, the best of some runs in
    turns.

    The face alone tells a wrong hit: exact arithmetic must have it among the nearest. The
    distance that comes with it is judged in units in the last place. It could not tell a
    neighbour at a flat angle, nor a right face with an inaccurate t.
    """
    best = dict.fromkeys((contender.name for contender in contenders), np.inf)
    found: dict[str, HitArrays] = {}
    for _ in range(repeats):
        for contender in contenders:
            hits, seconds = contender.closest_hit(origins, directions)
            found[contender.name] = hits
            best[contender.name] = min(best[contender.name], seconds)
    exact_t, exact_face = found[KERNELS["exact"]]
    rows = []
    for name, (t, face) in found.items():
        same = (face == exact_face) & (face >= 0)
        other = np.flatnonzero((face != exact_face) & (face >= 0))
        leaks = int((face < 0).sum())
        rays_of_others = origins[other], directions[other]
        tied = ties(mesh, *rays_of_others, face[other], exact_t[other])
        wrong = other[~tied]
        off = np.abs(t[wrong] - exact_t[wrong].astype(np.float64))
        # Positive floats are in the order of their bits.
        ulps = np.abs(
            t[same].view(np.int32).astype(np.int64) - exact_t[same].view(np.int32)
        )
        rows.append(
            {
                "name": name,
                "rays": len(t),
                "leaks": leaks,
                "other_hits": int((face != exact_face).sum()),
                "wrong_hits": len(wrong),
                "far_off": int(np.count_nonzero(~(off <= FAR_OFF * exact_t[wrong]))),
                "wrong_per_billion": (leaks + len(wrong)) / len(t) * 1e9,
                "inexact_t": int(np.count_nonzero(ulps)),
                "ulps_p99": float(np.percentile(ulps, 99)) if len(ulps) else 0.0,
                "ulps_max": int(ulps.max(initial=0)),
                "rays_per_second": len(t) / best[name],
            }
        )
    return rows


def ties(
    mesh: ClosedMesh,
    origins: FloatArray,
    directions: FloatArray,
    face: npt.NDArray[np.int64],
    exact_t: FloatArray,
) -> npt.NDArray[np.bool_]:
    """Which rays meet the face as near as the nearest one is, by whole numbers."""
    t = exact_distances(origins, directions, mesh.vertices[mesh.faces[face]])
    tied: npt.NDArray[np.bool_] = t == exact_t
    return tied
