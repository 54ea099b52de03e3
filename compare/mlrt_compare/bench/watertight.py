"""mlrt-bench watertight: rays from inside of closed meshes, aimed at vertices and edges.

Every such ray meets a face: one that finds nothing has passed between two that share an
edge or a vertex, and is counted as a leak.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .closed_meshes import ClosedMesh, FaceArray, InnerBalls, inner_balls
from .hit_contenders import FloatArray, HitContender

IndexArray = npt.NDArray[np.int64]

BATCH = 2**18
"""Rays that are made and traced at a time."""
BALLS = 64
"""Regions inside of a mesh that rays start in."""
SHARING = 4096
"""Rays in a row that start at the same point, where some do: as many as MLRT traces in one
group."""
NEIGHBOURS = 2 * SHARING
"""Faces along a curve through space that rays of one origin are aimed at: so many that few
rays are the same, so few that beams are narrow."""
OTHERS = 16
"""All but the first contender, MLRT as usual, trace one batch in so many."""
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

    rays: int
    """That were traced."""
    count: int
    examples: list[tuple[list[float], list[float]]]
    """Origins and directions."""


@dataclass(frozen=True)
class Range:
    """A mesh to aim at, and where from."""

    mesh: ClosedMesh
    """Its faces in Morton order of their middles."""
    balls: InnerBalls


def range_of(mesh: ClosedMesh, seed: int) -> Range:
    faces = mesh.faces[morton_order(mesh.vertices[mesh.faces].mean(axis=1))]
    mesh = ClosedMesh(mesh.name, mesh.vertices, faces)
    return Range(mesh, inner_balls(mesh, np.random.default_rng(seed), BALLS))


def morton_order(points: FloatArray) -> IndexArray:
    """Order of points (N, 3) along a Z-shaped curve through a grid of 1024^3 cells."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.where(high > low, high - low, 1)
    cells = ((points - low) / size * 1023).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.argsort(code, kind="stable")


def chosen_faces(
    faces: FaceArray, rng: np.random.Generator, aim: Aim, count: int
) -> FaceArray:
    """At random (count, 3): from anywhere, or for each run from neighbours, in order."""
    if not aim.share_origin:
        anywhere: FaceArray = faces[rng.integers(0, len(faces), count)]
        return anywhere
    runs = -(-count // SHARING)
    window = min(NEIGHBOURS, len(faces))
    first = rng.integers(0, len(faces) - window + 1, (runs, 1))
    within = np.sort(rng.integers(0, window, (runs, SHARING), np.uint16), axis=1)
    chosen: FaceArray = faces[(first + within).reshape(-1)[:count]]
    return chosen


def targets(mesh: ClosedMesh, rng: np.random.Generator, aim: Aim, count: int) -> FloatArray:
    """Points (N, 3) of the mesh, rounded where they are not vertices."""
    face = chosen_faces(mesh.faces, rng, aim, count)
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
    field: Range, rng: np.random.Generator, aim: Aim, count: int
) -> tuple[FloatArray, FloatArray]:
    """Origins and directions; the target is at t = 1."""
    balls = len(field.balls.radii)
    if aim.share_origin:
        starts = field.balls.points(rng, rng.integers(0, balls, -(-count // SHARING)))
        origins = np.repeat(starts, SHARING, axis=0)[:count]
    else:
        origins = field.balls.points(rng, rng.integers(0, balls, count))
    return origins, targets(field.mesh, rng, aim, count) - origins


def batches(count: int) -> Iterator[int]:
    for first in range(0, count, BATCH):
        yield min(BATCH, count - first)


def trace(
    field: Range, contenders: list[HitContender], aim: Aim, count: int, seed: int
) -> dict[str, Leaks]:
    """Traces rays with all contenders, the first of which gets all batches; leaks by
    name."""
    rng = np.random.default_rng(seed)
    found = {contender.name: Leaks(0, 0, []) for contender in contenders}
    for number, size in enumerate(batches(count)):
        origins, directions = rays(field, rng, aim, size)
        for contender in contenders if number % OTHERS == 0 else contenders[:1]:
            leaks = found[contender.name]
            lost = np.flatnonzero(contender.closest_hit(origins, directions)[1] < 0)
            leaks.rays += size
            leaks.count += len(lost)
            for i in lost[: KEPT - len(leaks.examples)]:
                leaks.examples.append((origins[i].tolist(), directions[i].tolist()))
    return found
