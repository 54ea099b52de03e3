"""Triangle scenes and sets of rays that make tracers fail.

A scene is (vertices (V, 3) float32, faces (F, 3) uint32), a set of rays is (origins,
directions), both (N, 3) float32. Coordinates are snapped to a grid where rays should meet
vertices and edges exactly, not just nearly: then differences of coordinates are exact.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from mlrt_compare.bench import adversarial

FloatArray = npt.NDArray[np.float32]
IndexArray = npt.NDArray[np.uint32]
Scene = tuple[FloatArray, IndexArray]
Rays = tuple[FloatArray, FloatArray]

GRID = 2.0**-10


def snap(values: npt.ArrayLike) -> FloatArray:
    """Rounds to multiples of GRID: below 2^13 they and their differences are float32."""
    return (np.round(np.asarray(values, np.float64) / GRID) * GRID).astype(np.float32)


def soup(rng: np.random.Generator, count: int, size: float = 0.3) -> Scene:
    """Returns unconnected triangles of edge length about ``size`` in the box [-1, 1]^3."""
    centres = rng.uniform(-1, 1, (count, 1, 3))
    vertices = snap(centres + rng.uniform(-size, size, (count, 3, 3))).reshape(-1, 3)
    return vertices, np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def box() -> Scene:
    """Returns the closed box [-1, 1]^3 of 12 triangles."""
    vertices = np.array(list(itertools.product((-1, 1), repeat=3)), np.float32)
    quads = [
        (0, 1, 3, 2),
        (4, 6, 7, 5),
        (0, 4, 5, 1),
        (2, 3, 7, 6),
        (0, 2, 6, 4),
        (1, 5, 7, 3),
    ]
    faces = [f for a, b, c, d in quads for f in ((a, b, c), (a, c, d))]
    return vertices, np.array(faces, np.uint32)


def sphere(subdivisions: int = 3) -> Scene:
    """Returns a closed sphere of radius 1: an octahedron whose faces are split in four."""
    points = [np.array(p, float) for p in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))]
    points += [np.array((0.0, 0.0, 1.0)), np.array((0.0, 0.0, -1.0))]
    faces = [
        (0, 2, 4),
        (2, 1, 4),
        (1, 3, 4),
        (3, 0, 4),
        (2, 0, 5),
        (1, 2, 5),
        (3, 1, 5),
        (0, 3, 5),
    ]
    for _ in range(subdivisions):
        middles: dict[tuple[int, int], int] = {}

        def middle(i: int, j: int, seen: dict[tuple[int, int], int]) -> int:
            key = (min(i, j), max(i, j))
            if key not in seen:
                centre = points[i] + points[j]
                points.append(centre / np.linalg.norm(centre))
                seen[key] = len(points) - 1
            return seen[key]

        split = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b, middles), middle(b, c, middles), middle(c, a, middles)
            split += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = split
    return snap(points), np.array(faces, np.uint32)


def fan(count: int = 150) -> Scene:
    """Returns slivers that share one vertex, in a tilted plane."""
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    rim = np.stack([np.cos(angle), np.sin(angle), 0.25 * np.cos(angle)], axis=1)
    vertices = snap(np.concatenate([np.zeros((1, 3)), rim]))
    i = np.arange(count)
    faces = np.stack([np.zeros(count), 1 + i, 1 + (i + 1) % count], axis=1)
    return vertices, faces.astype(np.uint32)


def slivers(rng: np.random.Generator, count: int) -> Scene:
    """Returns needles and caps: two vertices, or all three of them, nearly on one line."""
    a = rng.uniform(-1, 1, (count, 3))
    along = rng.uniform(-1, 1, (count, 3))
    width = 10.0 ** rng.uniform(-7, -2, (count, 1)) * rng.uniform(-1, 1, (count, 3))
    third = np.where(np.arange(count)[:, None] % 2, a + width, a + 0.5 * along + width)
    vertices = np.stack([a, a + along, third], axis=1).astype(np.float32).reshape(-1, 3)
    return vertices, np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def duplicates(rng: np.random.Generator, count: int = 60) -> Scene:
    """Returns triangles in few axis-aligned and tilted planes that overlap and repeat."""
    vertices, faces = soup(rng, count, 0.7)
    vertices[: len(vertices) // 2, 2] = snap(
        rng.choice([-0.5, 0.0, 0.5], len(vertices) // 2)
    )
    for first in range(0, len(vertices) // 2, 3):
        vertices[first : first + 3, 2] = vertices[first, 2]
    repeated = np.concatenate(
        [faces, faces[::2], faces[::3][:, [2, 0, 1]], faces[::5][:, ::-1]]
    )
    return vertices, rng.permutation(repeated).astype(np.uint32)


def flat(rng: np.random.Generator, count: int = 100) -> Scene:
    """Returns triangles that all lie in the plane z = 0."""
    vertices, faces = soup(rng, count)
    vertices[:, 2] = 0
    return vertices, faces


def stairs(count: int = 12) -> Scene:
    """Returns a staircase of axis-aligned boxes that share faces."""
    unit, faces = box()
    vertices = np.concatenate([(unit + np.float32(1)) * [1, 1, 1 + i] + [2 * i, 0, 0]
                               for i in range(count)])  # fmt: skip
    corners = np.concatenate([faces + 8 * i for i in range(count)])
    return (vertices / 8 - 1).astype(np.float32), corners.astype(np.uint32)


def moved(scene: Scene, offset: float) -> Scene:
    """Returns a scene moved along the diagonal, its vertices rounded to float32 there."""
    return (scene[0].astype(np.float64) + offset).astype(np.float32), scene[1]


def scenes(rng: np.random.Generator) -> dict[str, Scene]:
    """Returns a scene of every kind, by name."""
    return {
        "soup": soup(rng, 300),
        "dense soup": soup(rng, 60, 1.5),
        "box": box(),
        "sphere": sphere(2),
        "fan": fan(),
        "slivers": slivers(rng, 150),
        "duplicates": duplicates(rng),
        "flat": flat(rng),
        "stairs": stairs(),
        "far sphere": moved(sphere(2), 1e6),
        "one triangle": soup(rng, 1, 1.0),
    }


def _bounds(scene: Scene) -> tuple[FloatArray, FloatArray]:
    return scene[0].min(axis=0), scene[0].max(axis=0)


def _towards(origins: FloatArray, targets: FloatArray) -> Rays:
    directions = targets - origins
    # A ray that starts at its target has no direction of its own.
    directions[~directions.any(axis=1)] = (1, 0, 0)
    return origins, directions


def _outside(rng: np.random.Generator, scene: Scene, count: int) -> FloatArray:
    """Returns grid points about as far from the scene as it is wide."""
    lo, hi = _bounds(scene)
    radius = max(float((hi - lo).max()), 1.0)
    way = rng.normal(size=(count, 3))
    way *= 1.5 * radius / np.linalg.norm(way, axis=1, keepdims=True)
    return snap((lo.astype(np.float64) + hi) / 2 + way)


def into_box(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays from outside to uniform points of the scene's box."""
    lo, hi = _bounds(scene)
    targets = (lo + rng.uniform(size=(count, 3)) * (hi - lo)).astype(np.float32)
    return _towards(_outside(rng, scene, count), targets)


def at_vertices(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays at vertices, exactly so where scene and origin lie on the grid."""
    return _towards(_outside(rng, scene, count), rng.choice(scene[0], count))


def _edges(
    rng: np.random.Generator, scene: Scene, count: int
) -> tuple[FloatArray, FloatArray]:
    face = rng.choice(scene[1], count)
    corner = rng.integers(0, 3, count)
    row = np.arange(count)
    return scene[0][face[row, corner]], scene[0][face[row, (corner + 1) % 3]]


def at_edges(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays at points of edges, rounded."""
    a, b = _edges(rng, scene, count)
    share = rng.uniform(size=(count, 1))
    targets = (a + share * (b.astype(np.float64) - a)).astype(np.float32)
    return _towards(_outside(rng, scene, count), targets)


def at_midpoints(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays at midpoints of edges, exactly so where scene and origin lie on the grid."""
    a, b = _edges(rng, scene, count)
    return _towards(_outside(rng, scene, count), (a + b) * np.float32(0.5))


def along_axes(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays with one, two or no components of either zero, through points of the scene."""
    signs = np.array(list(itertools.product((-1.0, -0.0, 0.0, 1.0), repeat=3)), np.float32)
    signs = signs[signs.any(axis=1)]
    directions = rng.choice(signs, count)
    targets = np.where(rng.random((count, 1)) < 0.5, rng.choice(scene[0], count),
                       into_box(rng, scene, count)[0])  # fmt: skip
    distance = np.float32(4)
    return (targets - distance * directions).astype(np.float32), directions


def from_vertices(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays that start on vertices, or on planes through vertices, where trees are split."""
    origins = rng.choice(scene[0], count)
    lo, hi = _bounds(scene)
    elsewhere = (lo + rng.uniform(size=(count, 3)) * (hi - lo)).astype(np.float32)
    origins = np.where(rng.random((count, 3)) < 0.5, origins, elsewhere)
    directions = snap(rng.uniform(-1, 1, (count, 3)))
    directions[rng.random((count, 3)) < 0.2] = 0
    directions[~directions.any(axis=1)] = (0, 0, -1)
    return origins, directions


def grazing(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays as `mlrt-bench hits` has them, so that both mean the same by the word."""
    return adversarial.grazing(rng, adversarial.SmallScene("", *scene), count)


def extreme_lengths(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Rays into the box whose directions, or components of them, are tiny or huge."""
    origins, directions = into_box(rng, scene, count)
    powers = 2.0 ** rng.choice([-140, -120, -60, -20, 20, 60, 100], (count, 1))
    with np.errstate(under="ignore", over="ignore"):
        directions = (directions.astype(np.float64) * powers).astype(np.float32)
    directions[rng.random((count, 3)) < 0.1] = np.float32(2.0**-149)
    directions[~np.isfinite(directions)] = 1
    return origins, directions


RAY_SETS: dict[str, Callable[[np.random.Generator, Scene, int], Rays]] = {
    rays.__name__: rays
    for rays in (
        into_box,
        at_vertices,
        at_edges,
        at_midpoints,
        along_axes,
        from_vertices,
        grazing,
        extreme_lengths,
    )
}


def all_rays(rng: np.random.Generator, scene: Scene, count: int) -> Rays:
    """Returns ``count`` rays of every set, one set after the other."""
    sets = [rays(rng, scene, count) for rays in RAY_SETS.values()]
    return np.concatenate([o for o, _ in sets]), np.concatenate([d for _, d in sets])


def camera(scene: Scene, axis: int, resolution: int) -> Rays:
    """Returns rays of a pinhole camera that looks along an axis at the middle of the scene.

    Pixel centres lie on the symmetry planes if the resolution is odd: directions of the
    middle row and column have components that are exactly zero.
    """
    lo, hi = _bounds(scene)
    centre = (lo.astype(np.float64) + hi) / 2
    radius = float((hi - lo).max())
    grid = (np.arange(resolution) - (resolution - 1) / 2) / resolution
    directions = np.zeros((resolution * resolution, 3), np.float32)
    v, u = np.meshgrid(grid, grid, indexing="ij")
    directions[:, axis] = 1
    directions[:, (axis + 1) % 3] = u.ravel()
    directions[:, (axis + 2) % 3] = v.ravel()
    origin = centre.copy()
    origin[axis] -= 1.5 * max(radius, 1e-3)
    return np.broadcast_to(origin.astype(np.float32), directions.shape).copy(), directions
