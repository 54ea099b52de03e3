"""The exact nearest hits of many rays, for studies that count wrong ones.

A ray {o + t d} meets the closed triangle (a, b, c) if the volumes

    U = |d, b-o, c-o|    V = |d, c-o, a-o|    W = |d, a-o, b-o|

are all >= 0 or all <= 0 and not all zero; then t = n.(a-o) / n.d with n = (b-a) x (c-a). A
hit counts if t, rounded to single precision, is positive and finite; hits are equally near
if the rounded t are equal.

Volumes are evaluated in double precision, for all pairs of rays and triangles at once, as
products of Pluecker coordinates; where their errors leave a sign open, or t between two
floats, whole numbers decide.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
IndexArray = npt.NDArray[np.int64]

PAIRS = 2**21
"""Of rays and triangles, that are held at a time."""
MARGIN = 2.0**-44
"""Of the sum of the sizes of all terms of a volume or of t: its value in double takes fewer
than 64 roundings, of 2^-53 each, and some of them act on parts of it only."""
SMALLEST = 2.0**-900
"""Sums below that may have lost terms to underflow."""


@dataclass(frozen=True)
class ExactHits:
    """All nearest hits of N rays.

    t: (N,) float32, inf for a miss. ray, face: (H,), pairs of which each is as near as t.
    """

    t: FloatArray
    ray: IndexArray
    face: IndexArray
    exact_pairs: int
    """Pairs that whole numbers had to decide."""

    def is_hit(self) -> npt.NDArray[np.bool_]:
        return np.isfinite(self.t)

    def includes(self, face: npt.NDArray[np.integer]) -> npt.NDArray[np.bool_]:
        """Whether a face for each ray is one of its nearest."""
        size = int(max(self.face.max(initial=0), face.max(initial=0))) + 1
        keys = self.ray * size + self.face
        rows = np.arange(len(self.t))
        return (face >= 0) & np.isin(rows * size + np.maximum(face, 0), keys)

    def lowest(self) -> IndexArray:
        """The lowest face of each ray, -1 for a miss."""
        found = np.full(len(self.t), np.iinfo(np.int64).max)
        np.minimum.at(found, self.ray, self.face)
        return np.where(self.is_hit(), found, -1)


class ExactTriangles:
    """Triangles that rays are asked about.

    vertices (V, 3) float32, all finite; faces (F, 3).
    """

    def __init__(self, vertices: FloatArray, faces: npt.NDArray[np.integer]) -> None:
        self._corners = vertices[faces]
        # Differences from a vertex are smaller, which is what margins are shares of.
        self._centre = vertices[0].astype(np.float64) if len(vertices) else np.zeros(3)
        corners = self._corners.astype(np.float64) - self._centre
        self._edges = []
        for i in range(3):
            p, q = corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]
            edge = np.concatenate([np.cross(p, q), q - p], axis=1).T
            size = np.concatenate([sizes_of_cross(p, q), np.abs(p) + np.abs(q)], axis=1).T
            self._edges.append((edge, size * MARGIN))
        self._a = corners[:, 0]
        ab, ac = corners[:, 1] - self._a, corners[:, 2] - self._a
        self._normal = np.cross(ab, ac)
        self._normal_size = sizes_of_cross(ab, ac)

    def nearest(self, origins: FloatArray, directions: FloatArray) -> ExactHits:
        """Rays (N, 3), finite and of directions that are not zero."""
        parts = list(self._chunks(origins, directions))
        t = np.concatenate([part.t for part in parts]) if parts else np.zeros(0, np.float32)
        first = np.cumsum([0, *(len(part.t) for part in parts)])
        rays = [part.ray + start for part, start in zip(parts, first, strict=False)]
        empty = [np.zeros(0, np.int64)]
        return ExactHits(
            t,
            np.concatenate(rays or empty),
            np.concatenate([part.face for part in parts] or empty),
            sum(part.exact_pairs for part in parts),
        )

    def _chunks(self, origins: FloatArray, directions: FloatArray) -> Iterator[ExactHits]:
        rows = max(1, PAIRS // max(1, len(self._corners)))
        for first in range(0, len(origins), rows):
            part = slice(first, first + rows)
            yield self._nearest(origins[part], directions[part])

    def _nearest(self, origins: FloatArray, directions: FloatArray) -> ExactHits:
        count = len(origins)
        ray, face, certain = self._candidates(origins, directions)
        t = np.full(len(ray), np.inf, np.float32)
        rounded, open_t = self._distances(origins, directions, ray, face)
        t[certain] = rounded[certain]
        undecided = np.flatnonzero(~certain | open_t)
        t[undecided] = exact_distances(
            origins[ray[undecided]],
            directions[ray[undecided]],
            self._corners[face[undecided]],
        )
        t[~(t > 0)] = np.inf
        least = np.full(count, np.inf, np.float32)
        np.minimum.at(least, ray, t)
        near = np.isfinite(t) & (t == least[ray])
        return ExactHits(least, ray[near], face[near], len(undecided))

    def _candidates(
        self, origins: FloatArray, directions: FloatArray
    ) -> tuple[IndexArray, IndexArray, npt.NDArray[np.bool_]]:
        """Pairs of rays and faces that may meet, and whether they certainly do."""
        o = origins.astype(np.float64) - self._centre
        d = directions.astype(np.float64)
        line = np.concatenate([d, np.cross(o, d)], axis=1)
        size = np.concatenate([np.abs(d), sizes_of_cross(o, d)], axis=1)
        shape = len(origins), len(self._corners)
        maybe = [np.ones(shape, bool), np.ones(shape, bool)]
        surely = [np.ones(shape, bool), np.ones(shape, bool)]
        for edge, edge_size in self._edges:
            value = line @ edge
            error = size @ edge_size + SMALLEST
            for side, signed in enumerate((value, -value)):
                maybe[side] &= signed >= -error
                surely[side] &= signed > error
        ray, face = np.nonzero(maybe[0] | maybe[1])
        return ray, face, (surely[0] | surely[1])[ray, face]

    def _distances(
        self, origins: FloatArray, directions: FloatArray, ray: IndexArray, face: IndexArray
    ) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """t of pairs, rounded to single precision, and whether it may round otherwise."""
        to_plane = self._a[face] - (origins.astype(np.float64) - self._centre)[ray]
        d = directions[ray].astype(np.float64)
        normal, normal_size = self._normal[face], self._normal_size[face]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            above = np.einsum("ij,ij->i", normal, to_plane)
            below = np.einsum("ij,ij->i", normal, d)
            # The position relative to the centre is itself rounded.
            reach = np.abs(self._a[face]) + np.abs(origins[ray] - self._centre)
            above_error = MARGIN * np.einsum("ij,ij->i", normal_size, reach)
            below_error = MARGIN * np.einsum("ij,ij->i", normal_size, np.abs(d))
            t = above / below
            error = 2 * (above_error + np.abs(t) * below_error) / np.abs(below)
            lower, upper = (t - error).astype(np.float32), (t + error).astype(np.float32)
            known = (below_error <= np.abs(below) / 2) & (lower == upper)
            # Sums that are tiny may have lost terms to underflow.
            known &= (np.abs(below) > SMALLEST) & (np.abs(above) > SMALLEST)
            return lower, ~known


def sizes_of_cross(a: DoubleArray, b: DoubleArray) -> DoubleArray:
    """Sums of the sizes of the terms of a x b."""
    a, b = np.abs(a), np.abs(b)
    return np.roll(a, -1, 1) * np.roll(b, 1, 1) + np.roll(a, 1, 1) * np.roll(b, -1, 1)


def whole(values: FloatArray, power: int) -> list[list[int]]:
    """Rows of values times 2^power, which must be whole numbers."""
    rows = values.reshape(len(values), -1)
    return [[int(math.ldexp(value, power)) for value in row] for row in rows.tolist()]


def power_of(*arrays: FloatArray) -> int:
    """The least power of two that makes all values whole numbers."""
    values = np.concatenate([array.ravel() for array in arrays])
    values = values[values != 0]
    if not len(values):
        return 0
    least = int(np.frexp(np.abs(values).min())[1])
    return max(0, min(149, 24 - least))


def exact_distances(
    origins: FloatArray, directions: FloatArray, corners: FloatArray
) -> FloatArray:
    """Rounded t of pairs of rays (P, 3) and triangles (P, 3, 3), inf where they do not
    meet."""
    if not len(origins):
        return np.zeros(0, np.float32)
    # Points and directions may have units of their own.
    power, unit = power_of(origins, corners), power_of(directions)
    rows = zip(
        whole(origins, power), whole(directions, unit), whole(corners, power), strict=True
    )
    return np.array([exact_distance(*row, unit - power) for row in rows], np.float32)


def exact_distance(o: list[int], d: list[int], corners: list[int], power: int) -> float:
    """Rounded t, in whole numbers: its value is 2^power times that of the arguments."""
    ox, oy, oz = o
    dx, dy, dz = d
    ax, ay, az = corners[0] - ox, corners[1] - oy, corners[2] - oz
    bx, by, bz = corners[3] - ox, corners[4] - oy, corners[5] - oz
    cx, cy, cz = corners[6] - ox, corners[7] - oy, corners[8] - oz
    # Edge normals b x c, c x a and a x b; their sum is that of the triangle.
    ux, uy, uz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    u = dx * ux + dy * uy + dz * uz
    vx, vy, vz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    v = dx * vx + dy * vy + dz * vz
    if (u < 0 < v) or (v < 0 < u):
        return math.inf
    wx, wy, wz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    w = dx * wx + dy * wy + dz * wz
    if (w < 0 and (u > 0 or v > 0)) or (w > 0 and (u < 0 or v < 0)):
        return math.inf
    below = u + v + w
    if below == 0:
        return math.inf
    above = ax * (ux + vx + wx) + ay * (uy + vy + wy) + az * (uz + vz + wz)
    return rounded(above, below, power)


def rounded(above: int, below: int, power: int) -> float:
    """The float32 nearest to 2^power above / below, ties to even; inf beyond the last."""
    if above == 0:
        return 0.0
    try:
        # Division of whole numbers rounds once, to double.
        value = math.ldexp(above / below, power)
    except OverflowError:
        value = 0.0
    if 2.0**-125 < abs(value) < 2.0**127:
        single = float(np.float32(value))
        steps = math.ldexp(value, 25 - math.frexp(value)[1])
        # Rounding twice does harm in the middle between two floats only.
        if steps != math.floor(steps) or int(steps) % 2 == 0:
            return single
    return rounded_fraction(Fraction(above, below) * Fraction(2) ** power)


def rounded_fraction(value: Fraction) -> float:
    size = abs(value)
    exponent = size.numerator.bit_length() - size.denominator.bit_length()
    if size < Fraction(2) ** exponent:
        exponent -= 1
    quantum = max(exponent - 23, -149)
    steps = round(size / Fraction(2) ** quantum)  # ties to even
    if steps.bit_length() + quantum > 128:
        return math.copysign(math.inf, value)
    return math.copysign(math.ldexp(steps, quantum), value)
