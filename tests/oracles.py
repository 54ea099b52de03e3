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
from functools import cached_property

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


def barycentric(
    origin: Point, direction: Point, a: Point, b: Point, c: Point
) -> tuple[Fraction, Fraction]:
    """Returns the exact weights of b and c at the point where a line meets a triangle.

    The line must meet it, see :func:`meet`.
    """
    a, b, c = _minus(a, origin), _minus(b, origin), _minus(c, origin)
    u = _dot(direction, _cross(b, c))
    v = _dot(direction, _cross(c, a))
    w = _dot(direction, _cross(a, b))
    return Fraction(v, u + v + w), Fraction(w, u + v + w)


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
class Crossing:
    """A face that a line meets, and the exact parameter where it does."""

    face: int
    exact: Fraction

    @cached_property
    def t(self) -> np.float32:
        """The float32 parameter that should be reported."""
        return round_to_float32(self.exact)


@dataclass(frozen=True)
class Hit:
    """The nearest hit of one ray: the float32 t and every face hit there, lowest first."""

    t: np.float32
    faces: tuple[int, ...]

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
        possible: npt.NDArray[np.bool_] = ~(below & above) & self.usable
        return possible

    def crossings(
        self, origins: npt.ArrayLike, directions: npt.ArrayLike
    ) -> Iterator[list[Crossing]]:
        """Yields for each ray where its line meets faces, lowest face first.

        origins, directions (N, 3) float32. Rays that hit nothing by contract meet nothing.
        """
        origins = np.asarray(origins, np.float32)
        directions = np.asarray(directions, np.float32)
        rows = max(1, 2_000_000 // max(1, len(self.faces)))
        for first in range(0, len(origins), rows):
            o, d = origins[first : first + rows], directions[first : first + rows]
            traceable = [is_traceable(*ray) for ray in zip(o, d, strict=True)]
            safe = np.array(traceable)[:, None]
            possible = safe & self.candidates(np.where(safe, o, 0), np.where(safe, d, 0))
            for i, row in enumerate(possible):
                found = []
                if row.any():
                    ray = to_point(o[i]), to_point(d[i])
                    for face in np.flatnonzero(row).tolist():
                        a, b, c = (self.points[j] for j in self.faces[face].tolist())
                        found.append((face, meet(*ray, a, b, c)))
                yield [Crossing(face, t) for face, t in found if t is not None]

    def hits(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        t_min: npt.ArrayLike = 0.0,
        t_max: npt.ArrayLike = math.inf,
    ) -> list[Hit | None]:
        """Returns the nearest hit of each ray, see :func:`nearest_hits`."""
        return nearest_hits(list(self.crossings(origins, directions)), t_min, t_max)


def nearest_hits(
    crossings: list[list[Crossing]],
    t_min: npt.ArrayLike = 0.0,
    t_max: npt.ArrayLike = math.inf,
) -> list[Hit | None]:
    """Returns the nearest hit of each ray in its interval, None for a miss.

    t_min, t_max (N,) or one number, float32.
    """
    lowest = np.broadcast_to(np.asarray(t_min, np.float32), len(crossings))
    highest = np.broadcast_to(np.asarray(t_max, np.float32), len(crossings))
    nearest: list[Hit | None] = []
    for ray, low, high in zip(crossings, lowest, highest, strict=True):
        # A parameter beyond the largest float32 is not reported: inf stands for a miss.
        found = [c for c in ray if low < c.t <= high and c.t <= _FLOAT32_MAX]
        t = min((c.t for c in found), default=np.float32(math.inf))
        faces = tuple(c.face for c in found if c.t == t)
        nearest.append(Hit(t, faces) if faces else None)
    return nearest


def _cross_of_sizes(a: DoubleArray, b: DoubleArray) -> DoubleArray:
    """Returns the sums of the magnitudes of the terms of a x b."""
    a, b = np.abs(a), np.abs(b)
    return np.roll(a, -1, 1) * np.roll(b, 1, 1) + np.roll(a, 1, 1) * np.roll(b, -1, 1)


def segment_meets_box(
    origin: npt.ArrayLike,
    direction: npt.ArrayLike,
    t_max: float,
    lower: npt.ArrayLike,
    upper: npt.ArrayLike,
) -> bool:
    """Returns whether {origin + t direction, 0 <= t <= t_max} meets a closed box."""
    entry, end = Fraction(0), None if math.isinf(t_max) else Fraction(t_max)
    axes = (to_point(vector) for vector in (origin, direction, lower, upper))
    for o, d, lo, hi in zip(*axes, strict=True):
        if d == 0:
            if not lo <= o <= hi:
                return False
            continue
        first, last = sorted((Fraction(lo - o, d), Fraction(hi - o, d)))
        entry = max(entry, first)
        end = last if end is None else min(end, last)
    return end is None or entry <= end


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
