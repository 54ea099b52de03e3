"""mlrt-bench watertight: rays from inside of closed meshes, aimed at vertices and edges.

Every such ray meets a face: one that finds nothing has passed between two that share an
edge or a vertex, and is counted as a leak.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .closed_meshes import ClosedMesh, inner_points
from .hit_contenders import FloatArray, HitContender

BATCH = 2**18
"""Rays that are made and traced at a time."""
ORIGINS = 64
"""Points inside of a mesh that rays start at."""
SHARING = 4096
"""Rays in a row that start at the same point, where some do: as many as MLRT traces in one
group."""
KEPT = 5
"""Leaks of each kind that are kept, so that they can be traced again."""


@dataclass(frozen=True)
class Aim:
    """What rays are aimed at, and whether those in a row share an origin."""

    target: str
    share_origin: bool

    @property
    def name(self) -> str:
        return f"{self.target}, {'one origin' if self.share_origin else 'many origins'}"


AIMS = tuple(
    Aim(target, share)
    for target in ("vertices", "middles of edges", "points of edges")
    for share in (True, False)
)


@dataclass
class Leaks:
    """Of one contender and aim."""

    count: int
    examples: list[tuple[list[float], list[float]]]
    """Origins and directions."""


def targets(mesh: ClosedMesh, rng: np.random.Generator, aim: Aim, count: int) -> FloatArray:
    """Points (N, 3) of the mesh, rounded where they are not vertices."""
    face = mesh.faces[rng.integers(0, len(mesh.faces), count)]
    corner = rng.integers(0, 3, count)
    row = np.arange(count)
    a = mesh.vertices[face[row, corner]]
    if aim.target == "vertices":
        return a
    b = mesh.vertices[face[row, (corner + 1) % 3]].astype(np.float64)
    middles = aim.target == "middles of edges"
    share = 0.5 if middles else rng.uniform(size=(count, 1))
    point: FloatArray = (a + share * (b - a)).astype(np.float32)
    return point


def rays(
    mesh: ClosedMesh, rng: np.random.Generator, points: FloatArray, aim: Aim, count: int
) -> tuple[FloatArray, FloatArray]:
    """Origins, of the given points, and directions; the target is at t = 1."""
    if aim.share_origin:
        runs = rng.integers(0, len(points), -(-count // SHARING))
        start: npt.NDArray[np.int64] = np.repeat(runs, SHARING)[:count]
    else:
        start = rng.integers(0, len(points), count)
    origins = points[start]
    return origins, targets(mesh, rng, aim, count) - origins


def batches(count: int) -> Iterator[int]:
    for first in range(0, count, BATCH):
        yield min(BATCH, count - first)


def trace(
    mesh: ClosedMesh,
    contenders: list[HitContender],
    aim: Aim,
    count: int,
    seed: int,
    points: FloatArray,
) -> dict[str, Leaks]:
    """Traces the same rays with all contenders; their leaks by name."""
    rng = np.random.default_rng(seed)
    found = {contender.name: Leaks(0, []) for contender in contenders}
    for size in batches(count):
        origins, directions = rays(mesh, rng, points, aim, size)
        for contender in contenders:
            leaks = found[contender.name]
            lost = np.flatnonzero(contender.closest_hit(origins, directions)[1] < 0)
            leaks.count += len(lost)
            for i in lost[: KEPT - len(leaks.examples)]:
                leaks.examples.append((origins[i].tolist(), directions[i].tolist()))
    return found


def points_of(mesh: ClosedMesh, seed: int) -> FloatArray:
    return inner_points(mesh, np.random.default_rng(seed), ORIGINS)
