"""Signed volumes of rays and triangles as fractions, to judge what beams keep of them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float32]


def lanes(bits: int) -> list[int]:
    return [lane for lane in range(16) if bits >> lane & 1]


def volumes(
    origin: FloatArray, direction: FloatArray, triangle: FloatArray
) -> tuple[list[Fraction], Fraction, Fraction]:
    """U, V, W of a ray, N.d, and a.N, exactly."""

    def point(values: npt.ArrayLike) -> list[Fraction]:
        return [Fraction(float(x)) for x in np.asarray(values)]

    def minus(p: list[Fraction], q: list[Fraction]) -> list[Fraction]:
        return [x - y for x, y in zip(p, q, strict=True)]

    def cross(p: list[Fraction], q: list[Fraction]) -> list[Fraction]:
        return [p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3]
                for k in range(3)]  # fmt: skip

    def dot(p: list[Fraction], q: list[Fraction]) -> Fraction:
        return sum((x * y for x, y in zip(p, q, strict=True)), Fraction(0))

    o, d = point(origin), point(direction)
    a, b, c = (minus(point(corner), o) for corner in triangle)
    normal = cross(minus(b, a), minus(c, a))
    edges = [dot(d, cross(b, c)), dot(d, cross(c, a)), dot(d, cross(a, b))]
    return edges, dot(normal, d), dot(a, normal)
