"""Things that stand on desks."""

from __future__ import annotations

from solids import Meshes, Point, turned


def screen(m: Meshes, foot: Point, turn: float) -> None:
    """A monitor on its foot; unturned it faces -y."""
    x, y, z = foot
    m.box("plastic", (x - 0.12, y - 0.08, z), (x + 0.12, y + 0.08, z + 0.015), turn, foot)
    m.box(
        "plastic",
        (x - 0.03, y + 0.01, z + 0.015),
        (x + 0.03, y + 0.04, z + 0.2),
        turn,
        foot,
    )
    m.box(
        "plastic", (x - 0.3, y - 0.02, z + 0.12), (x + 0.3, y + 0.02, z + 0.5), turn, foot
    )
    face = [
        (x - 0.28, z + 0.14),
        (x + 0.28, z + 0.14),
        (x + 0.28, z + 0.48),
        (x - 0.28, z + 0.48),
    ]
    m.polygon("screen", *(turned((a, y - 0.0215, b), turn, foot) for a, b in face))


def mug(m: Meshes, material: str, foot: Point, sides: int = 6) -> None:
    m.tube(material, foot, (0.035, 0.042), 0.095, sides)
    m.disc("dark_wood", (foot[0], foot[1], foot[2] + 0.075), 0.04, sides)


def lamp(m: Meshes, foot: Point, sides: int = 6) -> None:
    x, y, z = foot
    m.tube("metal", foot, (0.1, 0.08), 0.03, sides)
    m.disc("metal", (x, y, z + 0.03), 0.08, sides)
    m.box("metal", (x - 0.012, y - 0.012, z + 0.03), (x + 0.012, y + 0.012, z + 0.46))
    m.box("metal", (x - 0.25, y - 0.01, z + 0.44), (x + 0.012, y + 0.01, z + 0.46))
    m.tube("yellow", (x - 0.25, y, z + 0.33), (0.14, 0.05), 0.14, sides)
