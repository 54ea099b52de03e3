"""How close a ray passes to the edges of triangles, exactly.

The square of the distance between the line {o + t d} and the segment {a + s (b - a),
0 <= s <= 1} is the minimum over s of the form

    q(x, x) / d.d    with    q(x, y) = (x.y)(d.d) - (x.d)(y.d),    x = a - o + s (b - a),

the square of what is left of x across d. It is a fraction of integers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

import numpy.typing as npt
from oracles import Point, Soup, to_point

UNIT = Fraction(1, 2**149)
"""Of the integers of `oracles.to_point`."""


def _dot(a: Point, b: Point) -> int:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def squared_distance(origin: Point, direction: Point, a: Point, b: Point) -> Fraction:
    """Returns the square of the distance between a line and a segment, in units of 2^-298.

    The direction must not be zero.
    """

    def across(x: Point, y: Point) -> int:
        return _dot(x, y) * _dot(direction, direction) - _dot(x, direction) * _dot(
            y, direction
        )

    start = (a[0] - origin[0], a[1] - origin[1], a[2] - origin[2])
    edge = (b[0] - a[0], b[1] - a[1], b[2] - a[2])
    length = across(edge, edge)
    # A segment along the line, or without length, is as far away everywhere.
    s = Fraction(-across(start, edge), length) if length else Fraction(0)
    s = min(max(s, Fraction(0)), Fraction(1))
    square = across(start, start) + 2 * s * across(start, edge) + s * s * length
    return square / _dot(direction, direction)


def edge_distance(
    soup: Soup,
    origin: npt.ArrayLike,
    direction: npt.ArrayLike,
    faces: Iterable[int] | None = None,
) -> float:
    """Returns the distance of a ray's line to the nearest edge of some faces, by default of
    all that can be hit, rounded at the end only; inf if there are none."""
    o, d = to_point(origin), to_point(direction)
    chosen = range(len(soup.faces)) if faces is None else faces
    squares = []
    for face in chosen:
        if soup.usable[face]:
            a, b, c = (soup.points[i] for i in soup.faces[face])
            squares += [squared_distance(o, d, *ends) for ends in ((a, b), (b, c), (c, a))]
    if not squares:
        return math.inf
    return _root(min(squares) * UNIT * UNIT)


def _root(square: Fraction) -> float:
    """Square root of a fraction that may be too small for a double."""
    if square == 0:
        return 0.0
    shift = (square.denominator.bit_length() - square.numerator.bit_length()) // 2
    return math.ldexp(math.sqrt(square * Fraction(4) ** shift), -shift)
