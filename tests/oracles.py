"""Exact answers to what the tracer is asked, in integers and fractions.

The hit contract. A ray of float32 origin O and direction d meets the closed float32
triangle (A, B, C) iff the determinants

    U = |d, B-O, C-O|    V = |d, C-O, A-O|    W = |d, A-O, B-O|

are all >= 0 or all <= 0 and not all zero (which is a ray in the triangle's plane, or a
triangle without area). Its parameter is t = n.(A-O) / n.d with n = (B-A) x (C-A); what is
reported is the float32 nearest to t. It counts if t_min < t <= t_max, compared in float32.
The nearest hit is the one of least float32 t and, among these, of the lowest face.

Every finite float32 is a multiple of 2^-149, so coordinates are scaled to integers first.
The scale cancels from signs and from t.
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
Point = tuple[int, int, int]

_SCALE = 2.0**149
_FLOAT32_MAX = float(np.finfo(np.float32).max)


def to_point(vector: npt.ArrayLike) -> Point:
    """Returns a float32 vector (3,), exactly, in units of 2^-149. It must be finite."""
    x, y, z = (
        int(float(component) * _SCALE) for component in np.asarray(vector, np.float32)
    )
    return x, y, z


def _minus(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Point, b: Point) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def meet(origin: Point, direction: Point, a: Point, b: Point, c: Point) -> Fraction | None:
    """Returns the exact parameter t at which the line of a ray meets a closed triangle.

    None if it doesn't, or if it lies in the triangle's plane. t may be negative.
    """
    a, b, c = _minus(a, origin), _minus(b, origin), _minus(c, origin)
    u = _dot(direction, _cross(b, c))
    v = _dot(direction, _cross(c, a))
    w = _dot(direction, _cross(a, b))
    if min(u, v, w) < 0 < max(u, v, w) or u == v == w == 0:
        return None
    normal = _cross(_minus(b, a), _minus(c, a))
    return Fraction(_dot(normal, a), _dot(normal, direction))


def round_to_float32(value: Fraction) -> np.float32:
    """Returns the float32 nearest to a fraction, ties to even, with overflow to infinity.

    Going through double would round twice.
    """
    if value == 0:
        return np.float32(0)
    magnitude = abs(value)
    # 2^exponent <= magnitude < 2^(exponent + 1)
    exponent = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
    if magnitude < Fraction(2) ** exponent:
        exponent -= 1
    quantum = max(exponent - 23, -149)
    # round() of a fraction takes ties to even.
    steps = round(magnitude / Fraction(2) ** quantum)
    if quantum + steps.bit_length() > 128:
        return np.float32(math.copysign(math.inf, value))
    return np.float32(math.copysign(math.ldexp(steps, quantum), value))


@dataclass(frozen=True)
class Hit:
    """The nearest hit of one ray.

    ``faces`` holds, lowest first, every face hit at the float32 ``t``; ``exact`` is the
    true parameter of the first of them.
    """

    t: np.float32
    faces: tuple[int, ...]
    exact: Fraction

    @property
    def face(self) -> int:
        """The face that the contract chooses."""
        return self.faces[0]


def is_traceable(origin: FloatArray, direction: FloatArray) -> bool:
    """Whether a ray may hit anything: it is finite and has a direction."""
    finite = np.isfinite(origin).all() and np.isfinite(direction).all()
    return bool(finite and direction.any())


class Soup:
    """Triangles that exact questions are asked about.

    vertices (V, 3) float32; faces (F, 3) integers. Faces with a vertex that is not finite
    are never hit.
    """

    def __init__(self, vertices: npt.ArrayLike, faces: npt.ArrayLike) -> None:
        vertices = np.asarray(vertices, np.float32)
        self.faces = np.asarray(faces, np.int64).reshape(-1, 3)
        finite = np.isfinite(vertices).all(axis=1)
        self.usable = finite[self.faces].all(axis=1)
        vertices = np.where(finite[:, None], vertices, np.float32(0))
        self.points = [to_point(vertex) for vertex in vertices]
        # Coordinates relative to a vertex are smaller and so need smaller margins. The
        # difference of two float32 in double is exact up to half an ulp of the difference.
        self.centre = vertices[0].astype(np.float64) if len(vertices) else np.zeros(3)
        self.corners = (vertices.astype(np.float64) - self.centre)[self.faces]

    def meet(
        self, origin: npt.ArrayLike, direction: npt.ArrayLike, face: int
    ) -> Fraction | None:
        """Returns the exact parameter of the line of a ray on a face, see :func:`meet`."""
        a, b, c = (self.points[i] for i in self.faces[face])
        return meet(to_point(origin), to_point(direction), a, b, c)

    def candidates(
        self, origins: FloatArray, directions: FloatArray
    ) -> npt.NDArray[np.bool_]:
        """Returns (N, F): False only where a line certainly passes a face by.

        U, V, W in double, as products of the line's and the edges' Pluecker coordinates,
        against 2^-40 of the sum of their terms' magnitudes: some 2^9 times the rounding
        error. Products of three float32 neither overflow nor underflow in double.
        """
        o = origins.astype(np.float64) - self.centre
        d = directions.astype(np.float64)
        line = np.concatenate([d, np.cross(o, d)], axis=1)
        line_size = np.concatenate([np.abs(d), _cross_of_sizes(o, d)], axis=1)
        below = np.zeros((len(d), len(self.faces)), bool)
        above = below.copy()
        for i in range(3):
            p, q = self.corners[:, (i + 1) % 3], self.corners[:, (i + 2) % 3]
            edge = np.concatenate([np.cross(p, q), q - p], axis=1)
            size = np.concatenate([_cross_of_sizes(p, q), np.abs(p) + np.abs(q)], axis=1)
            value = line @ edge.T
            margin = (line_size @ size.T) * 2.0**-40
            below |= value < -margin
            above |= value > margin
        return ~(below & above) & self.usable

    def hits(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_min: npt.ArrayLike = 0.0,
        t_max: npt.ArrayLike = math.inf,
    ) -> Iterator[Hit | None]:
        """Yields the nearest hit of each ray, None for a miss.

        origins, directions (N, 3); t_min, t_max (N,) or one number; all float32.
        """
        origins = np.asarray(origins, np.float32)
        directions = np.asarray(directions, np.float32)
        lowest = np.broadcast_to(np.asarray(t_min, np.float32), len(origins))
        highest = np.broadcast_to(np.asarray(t_max, np.float32), len(origins))
        rows = max(1, 2_000_000 // max(1, len(self.faces)))
        for first in range(0, len(origins), rows):
            block = slice(first, first + rows)
            traceable = [
                is_traceable(*ray)
                for ray in zip(origins[block], directions[block], strict=True)
            ]
            safe = np.array(traceable)[:, None]
            possible = safe & self.candidates(
                np.where(safe, origins[block], 0), np.where(safe, directions[block], 0)
            )
            for i, row in enumerate(possible, first):
                yield self._nearest(
                    origins[i], directions[i], lowest[i], highest[i], np.flatnonzero(row)
                )

    def _nearest(
        self,
        origin: FloatArray,
        direction: FloatArray,
        t_min: np.float32,
        t_max: np.float32,
        faces: npt.NDArray[np.intp],
    ) -> Hit | None:
        if not len(faces):
            return None
        o, d = to_point(origin), to_point(direction)
        limit: Fraction | None = None
        found: list[tuple[np.float32, int, Fraction]] = []
        for face in faces:
            a, b, c = (self.points[i] for i in self.faces[face])
            exact = meet(o, d, a, b, c)
            if exact is None or (limit is not None and exact > limit):
                continue
            t = round_to_float32(exact)
            if t_min < t <= t_max and t <= _FLOAT32_MAX:
                found.append((t, int(face), exact))
                # Rounding is monotonic: nothing beyond the next float32 is rounded to t.
                with np.errstate(over="ignore"):
                    beyond = np.nextafter(t, np.float32(math.inf))
                if np.isfinite(beyond):
                    limit = Fraction(float(beyond))
        if not found:
            return None
        nearest = min(found)[0]
        ties = [(face, exact) for t, face, exact in found if t == nearest]
        return Hit(nearest, tuple(face for face, _ in ties), ties[0][1])


def _cross_of_sizes(a: DoubleArray, b: DoubleArray) -> DoubleArray:
    """Returns the sums of the magnitudes of the terms of a x b."""
    a, b = np.abs(a), np.abs(b)
    return np.roll(a, -1, 1) * np.roll(b, 1, 1) + np.roll(a, 1, 1) * np.roll(b, -1, 1)


def double_hits(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    origins: npt.ArrayLike,
    directions: npt.ArrayLike,
    t_min: float = 0.0,
    t_max: float = math.inf,
) -> tuple[DoubleArray, npt.NDArray[np.int64]]:
    """Returns t (N,) and face (N,) of nearest hits by Moeller-Trumbore tests in double.

    A third opinion by other formulas than the oracle's: right wherever a ray keeps clear of
    edges. inf and -1 for a miss.
    """
    corners = np.asarray(vertices, np.float64)[np.asarray(faces, np.int64)]
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    t = np.full(len(np.asarray(origins)), math.inf)
    nearest = np.full(len(t), -1, np.int64)
    rays = zip(
        np.asarray(origins, np.float64), np.asarray(directions, np.float64), strict=True
    )
    for i, (o, d) in enumerate(rays):
        p = np.cross(d, ac)
        determinant = np.einsum("ij,ij->i", p, ab)
        with np.errstate(divide="ignore", invalid="ignore"):
            s = o - a
            u = np.einsum("ij,ij->i", s, p) / determinant
            q = np.cross(s, ab)
            v = q @ d / determinant
            distance = np.einsum("ij,ij->i", q, ac) / determinant
            inside = (
                (u >= 0)
                & (v >= 0)
                & (u + v <= 1)
                & (distance > t_min)
                & (distance <= t_max)
            )
        distance = np.where(inside, distance, math.inf)
        if inside.any():
            nearest[i] = int(np.argmin(distance))
            t[i] = distance[nearest[i]]
    return t, nearest
