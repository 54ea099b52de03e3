"""Writes the dragon: a coiled dragon on the ground, one closed surface, and its XML.

    python generate.py [--triangles N] [--seed S] [-o FOLDER]

The surface is a tube around a spine, closed by a fan at the tip of the tail and at the
snout, its points moved by scales, plates, a crest and noise down to the size of the
triangles, nearly all of which are smaller than a pixel at the usual size. Every edge has
two faces.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from dragon.body import Floats, Rings, rings
from dragon.skin import feature_places, noise_tables, skin
from scene_output import Request, View, ply, point_light, run, scene_xml, write_files

Indices = NDArray[np.int32]

SIZES = (2_000, 7_200_000, 20_000_000)
LENGTH_IN_CIRCUMFERENCES = 6.0
"""Rings for each vertex around the body: about square faces in the middle of the trunk."""
VERTICES_A_BLOCK = 1 << 17

COLOURS = {"skin": (0.30, 0.50, 0.25), "ground": (0.47, 0.43, 0.38)}
VIEW = View(31, (2.3, -6.5, 3.9), (-0.02, -0.1, 1.17))
LIGHT = point_light("lamp", (-4.4, -3.4, 5.0), (140, 134, 122))

GROUND = ((-40, -40, 0), (40, -40, 0), (40, 40, 0), (-40, 40, 0))
GROUND_FACES = ((0, 1, 2), (0, 2, 3))


def grid(triangles: int) -> tuple[int, int]:
    """Rings and vertices a ring of a surface of about ``triangles`` triangles."""
    around = max(round((triangles / 2 / LENGTH_IN_CIRCUMFERENCES) ** 0.5), 3)
    return max(round(triangles / 2 / around), 2), around


def faces(count: int, around: int) -> Indices:
    """Triangles of a tube of ``count`` rings of ``around`` vertices, whose ends are closed
    by two more vertices, the tail's and the snout's. Outward, (2 count around, 3)."""
    first = np.arange(count - 1, dtype=np.int32)[:, None] * np.int32(around)
    j = np.arange(around, dtype=np.int32)
    k = np.roll(j, -1)
    a, b = first + j, first + k
    c, d = a + np.int32(around), b + np.int32(around)
    # Diagonals change direction from face to face, so that the mesh has no grain.
    odd = ((j + np.arange(count - 1, dtype=np.int32)[:, None]) & 1 == 1)[..., None]
    one = np.where(odd, np.stack([a, b, c], 2), np.stack([a, d, c], 2))
    two = np.where(odd, np.stack([b, d, c], 2), np.stack([a, b, d], 2))
    tail, snout = np.int32(count * around), np.int32(count * around + 1)
    last = (count - 1) * around
    ends = (
        np.column_stack([np.full_like(j, tail), k, j]),
        np.column_stack([np.full_like(j, snout), last + j, last + k]),
    )
    sides = np.concatenate([one, two], axis=2).reshape(-1, 3)
    return np.concatenate([ends[0], sides, ends[1]]).astype(np.int32)


def surface(triangles: int, seed: int) -> tuple[Floats, Indices]:
    """Vertices (n, 3) in metres and faces (m, 3) of the dragon."""
    count, around = grid(triangles)
    angle = np.arange(around, dtype=np.float64) * (2 * np.pi / around)
    tables = noise_tables(seed, around)
    body = rings(count)
    places = feature_places(body)
    block = max(VERTICES_A_BLOCK // around, 1)
    points = [
        skin(Rings(*(x[i : i + block] for x in body)), angle, places, tables).reshape(-1, 3)
        for i in range(0, count, block)
    ]
    ends = [points[0][:around].mean(axis=0), points[-1][-around:].mean(axis=0)]
    ends[0] = ends[0] - 0.02 * body.along[0]
    ends[1] = ends[1] + 0.02 * body.along[-1]
    return np.concatenate([*points, np.stack(ends)]), faces(count, around)


def write(request: Request) -> str:
    """Writes dragon.xml and meshes/*.ply; returns what was written."""
    count, around = grid(request.triangles)

    def files() -> Iterator[tuple[str, bytes]]:
        vertices, indices = surface(request.triangles, request.seed)
        yield "meshes/skin.ply", ply(vertices, indices, decimals=6)
        yield "meshes/ground.ply", ply(GROUND, GROUND_FACES)
        yield "dragon.xml", scene_xml(VIEW, LIGHT, COLOURS)

    write_files(request.folder, files())
    total = 2 * count * around + len(GROUND_FACES)
    return f"{request.folder / 'dragon.xml'}: {total} triangles"


if __name__ == "__main__":
    run(
        "Writes the dragon: one closed, displaced surface.",
        Path(__file__).parent,
        SIZES,
        write,
    )
