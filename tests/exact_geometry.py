"""Clipping, areas and unions of polygons in fractions.

A point is a tuple of Fractions. Polygons are convex, given by their corners in order; one
of two corners or one is a segment or a point, and of none is empty.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np
import numpy.typing as npt

Point = tuple[Fraction, ...]
Polygon = list[Point]


def point(values: Iterable[float]) -> Point:
    """Returns finite floats, exactly."""
    return tuple(Fraction(float(v)) for v in values)


def polygon(triangle: npt.ArrayLike) -> Polygon:
    """Returns the corners of a triangle (3, k), exactly."""
    return [point(v) for v in np.asarray(triangle)]


def halve(corners: Polygon, axis: int, position: Fraction, side: int) -> Polygon:
    """Returns the part of a polygon with side * x[axis] >= side * position, side = 1 or -1.

    Sutherland and Hodgman 1974, without rounding: corners in the plane belong to the part.
    """
    inside = [side * corner[axis] >= side * position for corner in corners]
    if all(inside):
        return corners
    if not any(inside):
        return []
    kept: Polygon = []
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        da, db = side * (a[axis] - position), side * (b[axis] - position)
        if da >= 0:
            kept.append(a)
        if da * db < 0:
            t = da / (da - db)
            kept.append(tuple(p + t * (q - p) for p, q in zip(a, b, strict=True)))
    return kept


def clip(corners: Polygon, lo: Sequence[Fraction], hi: Sequence[Fraction]) -> Polygon:
    """Returns the part of a polygon in a closed box."""
    for axis in range(len(lo)):
        corners = halve(halve(corners, axis, lo[axis], 1), axis, hi[axis], -1)
    return corners


def bounds(corners: Polygon) -> tuple[Point, Point]:
    """Returns the least and the greatest coordinates of a polygon that is not empty."""
    columns = list(zip(*corners, strict=True))
    return tuple(min(c) for c in columns), tuple(max(c) for c in columns)


def overlaps(corners: Polygon, lo: Sequence[Fraction], hi: Sequence[Fraction]) -> bool:
    """Whether a convex polygon meets the interior of a box.

    Along an axis where the box has no extent, meeting it is enough: its interior is then
    that of the rectangle, the segment or the point that it is.

    Of the closed part of the polygon in the box, the mean of the corners lies off every
    face that not all corners lie in. If all do, no point of it is in the interior.
    """
    part = clip(corners, lo, hi)
    if not part:
        return False
    least, greatest = bounds(part)
    return all(
        low == high or (first < high and last > low)
        for low, high, first, last in zip(lo, hi, least, greatest, strict=True)
    )


def _cross_section(corners: Polygon, x: Fraction) -> tuple[Fraction, Fraction] | None:
    """Returns the interval of y in which a polygon in the plane meets the line at x."""
    ys = []
    for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
        if min(a[0], b[0]) <= x <= max(a[0], b[0]) and a[0] != b[0]:
            ys.append(a[1] + (x - a[0]) / (b[0] - a[0]) * (b[1] - a[1]))
    return (min(ys), max(ys)) if ys else None


def union_area(polygons: Sequence[Polygon]) -> Fraction:
    """Returns the area that polygons in the plane cover together.

    The lines x = const through all corners and all crossings of edges bound strips in which
    the covered length of the cross-section is an affine function of x.
    """
    polygons = [p for p in polygons if len(p) >= 3]
    edges = [
        (a, b)
        for p in polygons
        for a, b in zip(p, p[1:] + p[:1], strict=True)
        if a[0] != b[0]
    ]
    stops = {corner[0] for p in polygons for corner in p}
    for (a, b), (c, d) in itertools.combinations(edges, 2):
        slope_ab = (b[1] - a[1]) / (b[0] - a[0])
        slope_cd = (d[1] - c[1]) / (d[0] - c[0])
        if slope_ab != slope_cd:
            x = (c[1] - a[1] + slope_ab * a[0] - slope_cd * c[0]) / (slope_ab - slope_cd)
            if (
                max(min(a[0], b[0]), min(c[0], d[0]))
                < x
                < min(max(a[0], b[0]), max(c[0], d[0]))
            ):
                stops.add(x)
    total = Fraction(0)
    for left, right in itertools.pairwise(sorted(stops)):
        sections = (_cross_section(p, (left + right) / 2) for p in polygons)
        reached: Fraction | None = None
        for low, high in sorted(s for s in sections if s is not None):
            begin = low if reached is None else max(low, reached)
            if high > begin:
                total += (right - left) * (high - begin)
            reached = high if reached is None else max(reached, high)
    return total
