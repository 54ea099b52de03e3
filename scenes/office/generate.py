"""Writes the office scene: one PLY file a material, and the XML that puts them together.

    python generate.py [FOLDER]

A furnished room of about 800 triangles, the size of the scenes that interactive ray tracers
were first measured with. Metres, z up, the origin in a corner of the floor. Everything is
computed from the numbers below, so the files are the same byte for byte wherever they are
made.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from furniture import lamp, mug, screen
from scene_output import View, ply, point_light, scene_xml, write_files
from solids import Meshes, Point, turned

WIDTH, DEPTH, HEIGHT = 5.2, 4.4, 2.7

COLOURS = {
    "wall": (0.78, 0.74, 0.66),
    "ceiling": (0.85, 0.85, 0.83),
    "floor": (0.42, 0.29, 0.18),
    "rug": (0.30, 0.09, 0.08),
    "trim": (0.82, 0.81, 0.78),
    "sky": (0.55, 0.72, 0.90),
    "wood": (0.55, 0.36, 0.19),
    "dark_wood": (0.26, 0.15, 0.08),
    "metal": (0.45, 0.46, 0.48),
    "plastic": (0.09, 0.09, 0.10),
    "screen": (0.14, 0.30, 0.46),
    "fabric": (0.10, 0.22, 0.36),
    "white": (0.84, 0.84, 0.82),
    "red": (0.62, 0.12, 0.09),
    "green": (0.13, 0.38, 0.15),
    "blue": (0.12, 0.20, 0.50),
    "yellow": (0.76, 0.58, 0.14),
}


def room(m: Meshes) -> None:
    w, d, h = WIDTH, DEPTH, HEIGHT
    m.polygon("floor", (0, 0, 0), (w, 0, 0), (w, d, 0), (0, d, 0))
    m.polygon("ceiling", (0, 0, h), (0, d, h), (w, d, h), (w, 0, h))
    m.polygon("wall", (0, 0, 0), (0, 0, h), (w, 0, h), (w, 0, 0))
    m.polygon("wall", (w, 0, 0), (w, 0, h), (w, d, h), (w, d, 0))
    m.polygon("wall", (0, d, 0), (0, d, h), (0, 0, h), (0, 0, 0))
    # The wall at the back, around the window.
    x0, x1, z0, z1 = 2.35, 4.15, 0.95, 2.25
    m.polygon("wall", (0, d, 0), (w, d, 0), (w, d, z0), (0, d, z0))
    m.polygon("wall", (0, d, z1), (w, d, z1), (w, d, h), (0, d, h))
    m.polygon("wall", (0, d, z0), (x0, d, z0), (x0, d, z1), (0, d, z1))
    m.polygon("wall", (x1, d, z0), (w, d, z0), (w, d, z1), (x1, d, z1))
    m.polygon(
        "sky",
        (x0, d + 0.12, z0),
        (x1, d + 0.12, z0),
        (x1, d + 0.12, z1),
        (x0, d + 0.12, z1),
    )
    m.box("trim", (x0 - 0.08, d - 0.16, z0 - 0.05), (x1 + 0.08, d + 0.12, z0))
    m.box("trim", (x0, d, z1 - 0.06), (x1, d + 0.12, z1))
    middle = (x0 + x1) / 2
    m.box("trim", (middle - 0.03, d + 0.02, z0), (middle + 0.03, d + 0.1, z1 - 0.06))
    m.box("rug", (1.15, 0.95, 0), (3.75, 2.75, 0.015))
    # Door in the wall on the left.
    m.box("dark_wood", (0, 0.43, 0), (0.035, 1.23, 2.1))


def desk_by_the_window(m: Meshes) -> None:
    x0, x1, y0, y1, top = 2.3, 4.1, 3.4, 4.15, 0.74
    m.box("wood", (x0, y0, top - 0.035), (x1, y1, top))
    m.box("wood", (x0 + 0.05, y0 + 0.05, 0), (x0 + 0.09, y1 - 0.05, top - 0.035))
    m.box("wood", (x1 - 0.5, y0 + 0.05, 0.05), (x1 - 0.05, y1 - 0.05, top - 0.035))
    for low in (0.08, 0.29, 0.50):
        m.box("trim", (x1 - 0.48, y0 + 0.03, low), (x1 - 0.07, y0 + 0.05, low + 0.18))
    screen(m, (3.0, 3.88, top), 8)
    m.box("plastic", (2.78, 3.5, top), (3.2, 3.63, top + 0.02))
    lamp(m, (3.83, 3.85, top))
    mug(m, "red", (2.52, 3.6, top))
    m.box("white", (3.45, 3.5, top), (3.67, 3.8, top + 0.025), 12, (3.5, 3.6, 0))


def desk_at_the_left(m: Meshes) -> None:
    x0, x1, y0, y1, top = 0.12, 0.87, 1.5, 2.95, 0.74
    m.box("wood", (x0, y0, top - 0.035), (x1, y1, top))
    for x in (x0 + 0.04, x1 - 0.09):
        for y in (y0 + 0.04, y1 - 0.09):
            m.box("metal", (x, y, 0), (x + 0.05, y + 0.05, top - 0.035))
    screen(m, (0.36, 2.3, top), 82)
    m.box("plastic", (0.6, 2.08, top), (0.73, 2.5, top + 0.02))
    m.box("blue", (0.42, 1.62, top), (0.7, 1.82, top + 0.04), 9, (0.5, 1.7, 0))
    m.box("yellow", (0.44, 1.63, top + 0.04), (0.68, 1.81, top + 0.07), -7, (0.5, 1.7, 0))
    mug(m, "green", (0.7, 2.75, top))


def chair(m: Meshes, foot: Point, turn: float) -> None:
    """An office chair; unturned it faces +y."""
    x, y, _ = foot
    for extra in (0, 90):
        m.box(
            "plastic",
            (x - 0.28, y - 0.03, 0.03),
            (x + 0.28, y + 0.03, 0.07),
            turn + extra,
            foot,
        )
    m.tube("metal", (x, y, 0.07), (0.03, 0.03), 0.36)
    m.box("fabric", (x - 0.24, y - 0.23, 0.43), (x + 0.24, y + 0.24, 0.5), turn, foot)
    m.box("fabric", (x - 0.22, y - 0.28, 0.5), (x + 0.22, y - 0.23, 1.02), turn, foot)


def shelf(m: Meshes) -> None:
    """Shelves with books in the corner at the back left."""
    x0, x1, y0, y1, top = 0.45, 1.75, DEPTH - 0.34, DEPTH - 0.03, 2.05
    m.box("dark_wood", (x0, y0, 0), (x0 + 0.03, y1, top))
    m.box("dark_wood", (x1 - 0.03, y0, 0), (x1, y1, top))
    boards = (0.09, 0.58, 1.07, 1.56, 2.02)
    for z in boards:
        m.box("dark_wood", (x0 + 0.03, y0, z), (x1 - 0.03, y1, z + 0.03))
    rows = (
        (0.12, ((0.09, 0.34, "red"), (0.1, 0.3, "blue"), (0.09, 0.36, "white"))),
        (
            0.61,
            (
                (0.07, 0.3, "green"),
                (0.08, 0.33, "yellow"),
                (0.06, 0.27, "white"),
                (0.09, 0.31, "blue"),
            ),
        ),
        (1.10, ((0.06, 0.28, "blue"), (0.08, 0.32, "red"), (0.07, 0.25, "green"))),
        (1.59, ((0.08, 0.26, "yellow"), (0.09, 0.3, "fabric"))),
    )
    for i, (z, books) in enumerate(rows):
        x = x0 + 0.06 + 0.17 * i
        for thickness, tall, colour in books:
            m.box(colour, (x, y0 + 0.03, z), (x + thickness, y1 - 0.06, z + tall))
            x += thickness + 0.008
    m.box("trim", (1.25, y0 + 0.02, 0.61), (1.6, y1 - 0.04, 0.8))


def picture(m: Meshes) -> None:
    m.box("dark_wood", (0, 1.75, 1.35), (0.03, 2.75, 2.05))
    m.polygon(
        "white", (0.034, 1.8, 1.4), (0.034, 2.7, 1.4), (0.034, 2.7, 2.0), (0.034, 1.8, 2.0)
    )
    m.polygon("blue", (0.038, 1.95, 1.5), (0.038, 2.3, 1.5), (0.038, 2.12, 1.88))
    m.polygon(
        "red",
        (0.042, 2.2, 1.5),
        (0.042, 2.58, 1.5),
        (0.042, 2.58, 1.72),
        (0.042, 2.2, 1.72),
    )


def plant(m: Meshes) -> None:
    pot = (4.55, 2.6, 0.0)
    m.tube("red", pot, (0.15, 0.2), 0.34)
    m.disc("dark_wood", (pot[0], pot[1], 0.3), 0.19)
    for i in range(9):
        angle, reach, rise = 97 * i, 0.36 - 0.015 * i, 0.7 + 0.055 * i
        leaf = [(0.03, -0.01, 0.3), (reach * 0.6, -0.07, rise - 0.05), (reach, 0.0, rise)]
        leaf.append((reach * 0.6, 0.07, rise - 0.05))
        moved = [(pot[0] + x, pot[1] + y, z) for x, y, z in leaf]
        m.polygon("green", *(turned(p, angle, pot) for p in moved))


def build() -> Meshes:
    m = Meshes()
    room(m)
    desk_by_the_window(m)
    desk_at_the_left(m)
    chair(m, (2.85, 2.95, 0), 14)
    chair(m, (1.25, 2.2, 0), 70)
    shelf(m)
    picture(m)
    plant(m)
    return m


VIEW = View(68, (4.8, 0.25, 1.75), (1.95, 3.2, 0.62))

DESK_LAMP = """    <emitter type="spot" id="desk-lamp">
        <transform name="to_world">
            <lookat origin="3.58, 3.85, 1.12" target="3.58, 3.85, 0" up="0, 1, 0"/>
        </transform>
        <rgb name="intensity" value="3.4, 2.9, 2"/>
        <float name="cutoff_angle" value="75"/>
        <float name="beam_width" value="50"/>
        <float name="sampling_weight" value="0.4"/>
    </emitter>
"""


def write(folder: Path) -> None:
    """Writes office.xml and meshes/*.ply into ``folder``."""
    meshes = build()
    light = point_light("room-light", (3.35, 1.15, 2.3), (18, 17.2, 15.6))
    plys = (
        (f"meshes/{name}.ply", ply(meshes.vertices[name], meshes.faces[name]))
        for name in COLOURS
    )
    xml = scene_xml(VIEW, light + DESK_LAMP, COLOURS)
    write_files(folder, [*plys, ("office.xml", xml)])


if __name__ == "__main__":
    write(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
