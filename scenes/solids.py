"""Flat-faced solids, collected by material: what the furniture of the scenes is made of.

Points are in metres, z up, in the frame of whoever collects them.
"""

from __future__ import annotations

import itertools
import math
from collections import defaultdict

Point = tuple[float, float, float]
Face = tuple[int, ...]


class Meshes:
    """Faces by material. Each object brings vertices of its own, so that every face is
    flat."""

    def __init__(self) -> None:
        self.vertices: dict[str, list[Point]] = defaultdict(list)
        self.faces: dict[str, list[Face]] = defaultdict(list)

    def polygon(self, material: str, *corners: Point) -> None:
        """A convex polygon, as a fan."""
        first = len(self.vertices[material])
        self.vertices[material].extend(corners)
        for i in range(1, len(corners) - 1):
            self.faces[material].append((first, first + i, first + i + 1))

    def box(
        self,
        material: str,
        low: Point,
        high: Point,
        turn: float = 0.0,
        about: Point = (0, 0, 0),
    ) -> None:
        """A cuboid from ``low`` to ``high``, turned by ``turn`` degrees around a vertical
        axis."""
        x, y, z = zip(low, high, strict=True)
        corners = [
            turned((x[i & 1], y[i >> 1 & 1], z[i >> 2]), turn, about) for i in range(8)
        ]
        for face in (
            (0, 2, 3, 1),
            (4, 5, 7, 6),
            (0, 1, 5, 4),
            (2, 6, 7, 3),
            (0, 4, 6, 2),
            (1, 3, 7, 5),
        ):
            self.polygon(material, *(corners[i] for i in face))

    def tube(
        self,
        material: str,
        centre: Point,
        radii: tuple[float, float],
        height: float,
        sides: int = 6,
    ) -> None:
        """A vertical cone frustum without its lids: ``radii`` at the bottom and at the
        top."""
        rings = [
            circle(centre, radii[0], 0, sides),
            circle(centre, radii[1], height, sides),
        ]
        for i in range(sides):
            j = (i + 1) % sides
            self.polygon(material, rings[0][i], rings[0][j], rings[1][j], rings[1][i])

    def disc(self, material: str, centre: Point, radius: float, sides: int = 6) -> None:
        self.polygon(material, *circle(centre, radius, 0, sides))

    def disc_upright(
        self, material: str, centre: Point, radius: float, sides: int = 6
    ) -> None:
        """A disc that faces -y."""
        x, y, z = centre
        rim = circle((x, z, y), radius, 0, sides)
        self.polygon(material, *((a, c, b) for a, b, c in rim))

    def pillow(
        self,
        material: str,
        centre: Point,
        half: Point,
        power: float = 1.0,
        sides: int = 16,
        bands: int = 8,
    ) -> None:
        """A superellipsoid of half axes ``half``: an ellipsoid for ``power`` 1, the closer
        to a cuboid the smaller it is."""
        rings = [
            [bulged(math.pi * (i / bands - 0.5), 2 * math.pi * j / sides, power)
             for j in range(sides)]
            for i in range(1, bands)
        ]  # fmt: skip
        low, high = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
        cx, cy, cz = centre

        def face(*corners: Point) -> None:
            self.polygon(
                material,
                *(
                    (
                        cx + half[0] * x,
                        cy + half[1] * y,
                        cz + half[2] * z,
                    )
                    for x, y, z in corners
                ),
            )

        for j in range(sides):
            k = (j + 1) % sides
            face(low, rings[0][k], rings[0][j])
            face(high, rings[-1][j], rings[-1][k])
            for below, above in itertools.pairwise(rings):
                face(below[j], below[k], above[k], above[j])


def turned(point: Point, degrees: float, about: Point) -> Point:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x, y = point[0] - about[0], point[1] - about[1]
    return (about[0] + c * x - s * y, about[1] + s * x + c * y, point[2])


def circle(centre: Point, radius: float, lift: float, sides: int) -> list[Point]:
    angles = (2 * math.pi * (i + 0.5) / sides for i in range(sides))
    x, y, z = centre
    return [(x + radius * math.cos(a), y + radius * math.sin(a), z + lift) for a in angles]


def bulged(latitude: float, longitude: float, power: float) -> Point:
    """A point of the superellipsoid of half axes 1; angles in radians."""

    def raised(x: float) -> float:
        return math.copysign(abs(x) ** power, x)

    flat = raised(math.cos(latitude))
    return (
        flat * raised(math.cos(longitude)),
        flat * raised(math.sin(longitude)),
        raised(math.sin(latitude)),
    )
