"""Walls, floors and doors of the building. Metres.

A room's frame: its foot is in the middle of its side on the corridor, x along the corridor,
y into the room, z up from the floor. A bay is a room on each side with the corridor between
them.
"""

from __future__ import annotations

from typing import Literal

from solids import Meshes

BAY, DEPTH, CORRIDOR = 4.0, 5.45, 2.4
HEIGHT, STOREY = 2.8, 3.15
THICKNESS = 0.12
FAR = 5.2
"""y of a room's wall with the window."""
SIDE = BAY / 2 - THICKNESS / 2
"""x of a room's wall on the right."""
DOOR = (-1.75, -0.85, 2.1)
WIDE = (-1.6, 1.6, 2.4)
WINDOW = (-1.3, 1.3, 0.9, 2.3)

Opening = Literal["door", "wide"]


def room(opening: Opening) -> Meshes:
    """A room but for its walls to the next rooms, with an opening to the corridor."""
    m = Meshes()
    w = BAY / 2
    for z, material in ((0.0, "carpet"), (HEIGHT, "ceiling")):
        m.polygon(material, (-w, 0, z), (w, 0, z), (w, DEPTH, z), (-w, DEPTH, z))
    left, right, top = DOOR if opening == "door" else WIDE
    m.box("wall", (-w, 0, 0), (left, THICKNESS, HEIGHT))
    m.box("wall", (right, 0, 0), (w, THICKNESS, HEIGHT))
    m.box("wall", (left, 0, top), (right, THICKNESS, HEIGHT))
    for x in (left, right - 0.04):
        m.box("trim", (x, -0.015, 0), (x + 0.04, THICKNESS + 0.015, top - 0.04))
    m.box("trim", (left, -0.015, top - 0.04), (right, THICKNESS + 0.015, top))
    for x0, x1 in ((-w, left), (right, w)):
        m.box("trim", (x0, -0.012, 0), (x1, 0, 0.09))
        m.box("trim", (x0, THICKNESS, 0), (x1, THICKNESS + 0.012, 0.09))
    window(m)
    return m


def window(m: Meshes) -> None:
    """The outer wall with a window that shows the sky."""
    w = BAY / 2
    x0, x1, z0, z1 = WINDOW
    m.box("wall", (-w, FAR, 0), (w, DEPTH, z0))
    m.box("wall", (-w, FAR, z1), (w, DEPTH, STOREY))
    m.box("wall", (-w, FAR, z0), (x0, DEPTH, z1))
    m.box("wall", (x1, FAR, z0), (w, DEPTH, z1))
    y = DEPTH - 0.02
    m.polygon("sky", (x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1))
    m.box("trim", (x0 - 0.08, FAR - 0.12, z0 - 0.04), (x1 + 0.08, FAR, z0))
    for x in (x0, -0.03, x1 - 0.06):
        m.box("trim", (x, FAR + 0.1, z0), (x + 0.06, FAR + 0.16, z1))
    for z in (z0, z1 - 0.06):
        m.box("trim", (x0 + 0.06, FAR + 0.11, z), (x1 - 0.06, FAR + 0.15, z + 0.06))
    m.box("trim", (-w, FAR - 0.012, 0), (w, FAR, 0.09))


def partition() -> Meshes:
    """The wall between two rooms, in the frame of the room at its left, moved by half a
    bay."""
    m, t = Meshes(), THICKNESS / 2
    m.box("wall", (-t, THICKNESS, 0), (t, FAR, HEIGHT))
    for x0, x1 in ((-t - 0.012, -t), (t, t + 0.012)):
        m.box("trim", (x0, THICKNESS + 0.012, 0), (x1, FAR - 0.012, 0.09))
    return m


def door_leaf() -> Meshes:
    """The leaf of a door, hinged at the origin, closed along +x."""
    m = Meshes()
    width, top = DOOR[1] - DOOR[0] - 0.09, DOOR[2] - 0.05
    m.box("wood", (0.002, -0.022, 0.008), (width, 0.022, top))
    for y in (-0.034, 0.022):
        for z0, z1 in ((0.2, 0.95), (1.15, 1.9)):
            m.box("dark_wood", (0.14, y, z0), (width - 0.14, y + 0.012, z1))
    for y in (-0.065, 0.055):
        m.box("metal", (width - 0.17, y, 1.03), (width - 0.05, y + 0.01, 1.05))
    m.box("metal", (width - 0.07, -0.055, 1.03), (width - 0.05, 0.055, 1.05))
    return m


def corridor() -> Meshes:
    """A bay of corridor, its foot in the middle of its floor."""
    m, w, c = Meshes(), BAY / 2, CORRIDOR / 2
    m.polygon("floor", (-w, -c, 0), (w, -c, 0), (w, c, 0), (-w, c, 0))
    m.polygon("ceiling", (-w, -c, HEIGHT), (w, -c, HEIGHT), (w, c, HEIGHT), (-w, c, HEIGHT))
    m.box("rug", (-w, -0.55, 0), (w, 0.55, 0.008))
    return m


def fire_door() -> Meshes:
    """A wall across the corridor with a closed double door; x = 0 is its middle."""
    m, c, t = Meshes(), CORRIDOR / 2, THICKNESS / 2
    m.box("wall", (-t, -c, 0), (t, c, HEIGHT))
    for x in (-t - 0.03, t):
        for y in (-0.82, 0.01):
            m.box("green", (x, y, 0.01), (x + 0.03, y + 0.81, 2.1))
        m.box("trim", (x, -0.9, 0), (x + 0.03, -0.83, 2.18))
        m.box("trim", (x, 0.83, 0), (x + 0.03, 0.9, 2.18))
        m.box("trim", (x, -0.83, 2.11), (x + 0.03, 0.83, 2.18))
    for x in (-t - 0.08, t + 0.05):
        for y in (-0.1, 0.07):
            m.box("metal", (x, y, 0.95), (x + 0.03, y + 0.03, 1.25))
    return m


def gable() -> Meshes:
    """The wall at an end of a storey, from x = 0 to the outside at +x."""
    m = Meshes()
    half = CORRIDOR / 2 + DEPTH
    m.box("wall", (0, -half, 0), (0.25, half, STOREY))
    return m


def roof(bays: int) -> Meshes:
    m = Meshes()
    half = CORRIDOR / 2 + DEPTH
    m.box("wall", (-0.25, -half, 0), (bays * BAY + 0.25, half, 0.3))
    return m
