"""What stands in the rooms of the building. Metres; a foot is at the origin, and a piece
that has a front turns it to -y."""

from __future__ import annotations

import math

from furniture import lamp, mug, screen
from solids import Meshes, Point, turned

ORIGIN: Point = (0.0, 0.0, 0.0)
GOLDEN_ANGLE = 137.50776
SHELF_WIDTH, SHELF_DEPTH, SHELF_HEIGHT = 1.2, 0.32, 2.05
SHELF_BOARDS = (0.08, 0.47, 0.86, 1.25, 1.64, 2.02)
BOARD = 0.03


def workplace() -> Meshes:
    """A desk with what belongs on it, 1.6 x 0.8; the user sits at -y."""
    m, top = Meshes(), 0.74
    m.box("wood", (-0.8, -0.4, top - 0.035), (0.8, 0.4, top))
    m.box("wood", (-0.76, -0.35, 0), (-0.72, 0.35, top - 0.035))
    m.box("wood", (-0.72, 0.3, 0.25), (0.32, 0.32, top - 0.035))
    m.box("wood", (0.32, -0.35, 0.04), (0.76, 0.35, top - 0.035))
    for low in (0.06, 0.27, 0.48):
        m.box("trim", (0.34, -0.37, low), (0.74, -0.35, low + 0.19))
        m.box("metal", (0.48, -0.39, low + 0.12), (0.6, -0.37, low + 0.14))
    screen(m, (-0.1, 0.12, top), 0)
    m.box("plastic", (-0.32, -0.26, top), (0.12, -0.11, top + 0.016))
    for row in range(5):
        for key in range(14):
            x, y = -0.31 + key * 0.0303, -0.25 + row * 0.0272
            m.box("trim", (x, y, top + 0.016), (x + 0.026, y + 0.023, top + 0.023))
    m.pillow("plastic", (0.24, -0.2, top + 0.014), (0.032, 0.055, 0.016), 0.8, 14, 7)
    lamp(m, (0.62, 0.25, top), 24)
    m.pillow("trim", (0.37, 0.25, top + 0.38), (0.035, 0.035, 0.05), 1.0, 14, 8)
    mug(m, "red", (-0.6, -0.1, top), 24)
    for sheet in range(10):
        z = top + 0.004 * sheet
        m.box("white", (0.4, -0.3, z), (0.61, -0.01, z + 0.0035), 13 * sheet % 17 - 8)
    for pen, colour in enumerate(("blue", "red", "yellow")):
        foot = (-0.66 + 0.015 * pen, 0.24, top + 0.02)
        m.tube(colour, foot, (0.004, 0.004), 0.14, 6)
    m.tube("plastic", (-0.645, 0.24, top), (0.035, 0.04), 0.1, 20)
    return m


def chair() -> Meshes:
    """An office chair, its back at +y."""
    m = Meshes()
    for leg in range(5):
        turn = 72 * leg + 18
        m.box("plastic", (0.03, -0.022, 0.06), (0.29, 0.022, 0.1), turn)
        wheel = turned((0.28, 0, 0.03), turn, ORIGIN)
        m.pillow("plastic", wheel, (0.03, 0.03, 0.03), 0.9, 10, 6)
    m.tube("metal", (0, 0, 0.09), (0.03, 0.025), 0.34, 16)
    m.pillow("fabric", (0, 0, 0.47), (0.25, 0.25, 0.05), 0.45, 24, 10)
    m.pillow("fabric", (0, 0.25, 0.82), (0.22, 0.04, 0.27), 0.45, 24, 12)
    m.box("metal", (-0.03, 0.2, 0.42), (0.03, 0.29, 0.62))
    for x in (-0.28, 0.28):
        m.box("metal", (x - 0.015, -0.02, 0.44), (x + 0.015, 0.02, 0.65))
        m.pillow("plastic", (x, -0.02, 0.67), (0.035, 0.14, 0.02), 0.6, 14, 7)
    return m


def armchair() -> Meshes:
    m = Meshes()
    m.pillow("red", (0, 0.02, 0.32), (0.36, 0.36, 0.14), 0.4, 28, 12)
    m.pillow("red", (0, 0.34, 0.62), (0.38, 0.12, 0.34), 0.45, 28, 12)
    for x in (-0.4, 0.4):
        m.pillow("red", (x, 0.03, 0.42), (0.1, 0.38, 0.2), 0.45, 24, 10)
        for y in (-0.28, 0.36):
            m.tube("dark_wood", (x * 0.85, y, 0), (0.02, 0.03), 0.2, 10)
    return m


def table() -> Meshes:
    """A table for meetings, 2.2 x 1.1, with paper and mugs on it."""
    m, top = Meshes(), 0.74
    m.box("wood", (-1.1, -0.55, top - 0.04), (1.1, 0.55, top))
    for x in (-1.0, 0.94):
        for y in (-0.48, 0.42):
            m.box("metal", (x, y, 0), (x + 0.06, y + 0.06, top - 0.04))
    for i, x in enumerate((-0.75, 0.0, 0.75)):
        for y in (-0.33, 0.33):
            m.box(
                "white", (x - 0.1, y - 0.14, top), (x + 0.1, y + 0.14, top + 0.006), 5 * i
            )
            mug(m, ("green", "blue", "white")[i], (x + 0.2, y, top), 20)
    m.tube("blue", (0, 0, top), (0.05, 0.09), 0.2, 24)
    foliage(m, (0, 0, top + 0.15), 24, 0.22, 0.3)
    return m


def foliage(m: Meshes, foot: Point, leaves: int, reach: float, rise: float) -> None:
    """Leaves that bend outward from ``foot``, each folded along its middle."""
    shares = (0.0, 0.2, 0.45, 0.7, 0.9, 1.0)
    for i in range(leaves):
        far = reach * (0.45 + 0.55 * (i % 7) / 6)
        tall = rise * (1.0 - 0.75 * (i % 7) / 6 * (0.6 + 0.4 * (i % 3) / 2))
        middle = [(far * s, 0.0, tall * (2.1 * s - 1.1 * s * s)) for s in shares]
        half = [0.13 * reach * math.sin(math.pi * (0.12 + 0.88 * s)) for s in shares]
        turn = GOLDEN_ANGLE * i

        def at(k: int, side: float, middle: list[Point] = middle, turn: float = turn,
               half: list[float] = half) -> Point:  # fmt: skip
            x, _, z = middle[k]
            lift = 0.35 * half[k] * abs(side)
            point = turned((x, half[k] * side, z + lift), turn, ORIGIN)
            return (foot[0] + point[0], foot[1] + point[1], foot[2] + point[2])

        for side in (-1.0, 1.0):
            for k in range(len(shares) - 2):
                m.polygon("green", at(k, 0), at(k + 1, 0), at(k + 1, side), at(k, side))
            m.polygon("green", at(4, 0), at(5, 0), at(4, side))


def plant() -> Meshes:
    m = Meshes()
    m.tube("terracotta", ORIGIN, (0.14, 0.19), 0.32, 28)
    m.tube("terracotta", (0, 0, 0.28), (0.205, 0.205), 0.05, 28)
    m.disc("dark_wood", (0, 0, 0.3), 0.185, 28)
    m.tube("dark_wood", (0, 0, 0.3), (0.03, 0.02), 0.35, 10)
    foliage(m, (0, 0, 0.6), 48, 0.5, 0.75)
    foliage(m, (0, 0, 0.35), 24, 0.4, 0.35)
    return m


def shelf() -> Meshes:
    """Empty shelves, the back at y = 0."""
    m, w = Meshes(), SHELF_WIDTH / 2
    for x in (-w, w - BOARD):
        m.box("dark_wood", (x, -SHELF_DEPTH, 0), (x + BOARD, 0, SHELF_HEIGHT))
    m.box("dark_wood", (-w + BOARD, -0.015, 0.05), (w - BOARD, 0, SHELF_HEIGHT))
    for z in SHELF_BOARDS:
        m.box("dark_wood", (-w + BOARD, -SHELF_DEPTH, z), (w - BOARD, -0.015, z + BOARD))
    return m


def book(colour: str) -> Meshes:
    """A cuboid of edges 1 whose back edge at the lower left is at the origin; it stretches
    to +x, -y and +z."""
    m = Meshes()
    m.box(colour, (0, -1, 0), (1, 0, 1))
    return m


def ceiling_lamp() -> Meshes:
    """A box with a grid of slats that hangs from z = 0."""
    m = Meshes()
    m.box("white", (-0.6, -0.16, -0.05), (0.6, 0.16, -0.03))
    for y in (-0.16, 0.145):
        m.box("metal", (-0.6, y, -0.1), (0.6, y + 0.015, -0.05))
    for i in range(24):
        x = -0.6 + i * 1.188 / 23
        m.box("metal", (x, -0.145, -0.1), (x + 0.012, 0.145, -0.05))
    return m


def radiator() -> Meshes:
    """A radiator with its back at y = 0."""
    m = Meshes()
    for i in range(26):
        x = -0.75 + i * 0.058
        m.box("trim", (x, -0.1, 0.14), (x + 0.045, -0.03, 0.7))
    for z in (0.18, 0.62):
        m.box("trim", (-0.75, -0.08, z), (0.75, -0.05, z + 0.05))
    return m


def blind(width: float, low: float, high: float) -> Meshes:
    """Slats before a window, half open."""
    m = Meshes()
    for i in range(round((high - low) / 0.05)):
        z = high - 0.05 * i
        m.polygon(
            "trim",
            (-width / 2, -0.02, z - 0.018),
            (width / 2, -0.02, z - 0.018),
            (width / 2, 0.02, z),
            (-width / 2, 0.02, z),
        )
    return m


def picture(colours: tuple[str, str]) -> Meshes:
    """A framed picture, 0.9 x 0.65, its back at y = 0."""
    m = Meshes()
    m.box("dark_wood", (-0.45, -0.03, 0), (0.45, 0, 0.65))
    m.box("white", (-0.4, -0.034, 0.05), (0.4, -0.03, 0.6))
    m.disc_upright(colours[0], (-0.12, -0.037, 0.32), 0.16, 24)
    m.disc_upright(colours[1], (0.12, -0.039, 0.27), 0.12, 24)
    return m


def whiteboard() -> Meshes:
    m = Meshes()
    m.box("metal", (-1.0, -0.03, 0.9), (1.0, 0, 2.1))
    m.box("white", (-0.97, -0.035, 0.93), (0.97, -0.03, 2.07))
    m.box("metal", (-0.5, -0.1, 0.88), (0.5, -0.03, 0.9))
    return m


def basket() -> Meshes:
    m = Meshes()
    m.tube("plastic", ORIGIN, (0.11, 0.15), 0.32, 28)
    m.disc("plastic", (0, 0, 0.01), 0.11, 28)
    return m


def cabinet() -> Meshes:
    """A low cabinet with a printer on it, the back at y = 0."""
    m = Meshes()
    m.box("wood", (-0.5, -0.42, 0.04), (0.5, 0, 0.8))
    for x in (-0.48, 0.01):
        m.box("trim", (x, -0.44, 0.07), (x + 0.47, -0.42, 0.77))
        m.box("metal", (x + 0.2, -0.46, 0.4), (x + 0.27, -0.44, 0.42))
    m.pillow("trim", (0, -0.21, 0.93), (0.24, 0.19, 0.13), 0.25, 24, 10)
    m.box("white", (-0.11, -0.46, 0.86), (0.11, -0.3, 0.866))
    return m


def bench() -> Meshes:
    """A bench of slats, its back at y = 0."""
    m = Meshes()
    for i in range(5):
        m.box("wood", (-0.8, -0.08 - 0.09 * i, 0.43), (0.8, -0.015 - 0.09 * i, 0.46))
    for x in (-0.7, 0.66):
        m.box("metal", (x, -0.44, 0), (x + 0.04, -0.02, 0.43))
    return m


def rug() -> Meshes:
    m = Meshes()
    m.box("rug", (-0.8, -1.1, 0), (0.8, 1.1, 0.012))
    for y in (-1.0, 0.95):
        m.box("yellow", (-0.8, y, 0.012), (0.8, y + 0.05, 0.014))
    return m
