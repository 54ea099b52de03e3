"""How rooms are furnished: what stands where in a room's frame (see `building.shell`)."""

from __future__ import annotations

from typing import NamedTuple

import building.pieces as pieces
from building.instances import Mesh, prototype
from building.shell import FAR, HEIGHT, SIDE, THICKNESS, WINDOW, corridor, door_leaf

LEFT, RIGHT = -SIDE, SIDE

PICTURES = (("blue", "yellow"), ("red", "green"))

PIECES: dict[str, dict[str, Mesh]] = {
    name: prototype(solids)
    for name, solids in {
        "workplace": pieces.workplace(),
        "chair": pieces.chair(),
        "armchair": pieces.armchair(),
        "table": pieces.table(),
        "plant": pieces.plant(),
        "shelf": pieces.shelf(),
        "ceiling lamp": pieces.ceiling_lamp(),
        "radiator": pieces.radiator(),
        "blind": pieces.blind(WINDOW[1] - WINDOW[0] - 0.02, WINDOW[2] + 0.5, WINDOW[3]),
        "picture": pieces.picture(PICTURES[0]),
        "other picture": pieces.picture(PICTURES[1]),
        "whiteboard": pieces.whiteboard(),
        "basket": pieces.basket(),
        "cabinet": pieces.cabinet(),
        "bench": pieces.bench(),
        "rug": pieces.rug(),
        "corridor": corridor(),
        "door leaf": door_leaf(),
    }.items()
}


class Item(NamedTuple):
    piece: str
    x: float
    y: float
    turn: float = 0.0
    """Degrees; a piece that is not turned faces -y, one turned by 90 faces +x."""
    z: float = 0.0
    size: float = 1.0


LOOSE = {"chair": 25.0, "plant": 180.0, "armchair": 12.0}
"""By how many degrees at most chance turns pieces that stand free."""

EVERY_ROOM = (
    Item("ceiling lamp", 0, 1.5, 0, HEIGHT),
    Item("ceiling lamp", 0, 3.7, 0, HEIGHT),
    Item("radiator", 0, FAR),
    Item("blind", 0, FAR + 0.05),
    Item("basket", 0.95, 4.75),
)

DOUBLE_OFFICE = (
    Item("workplace", LEFT + 0.42, 3.3, 90),
    Item("chair", LEFT + 1.1, 3.3, 270),
    Item("workplace", RIGHT - 0.42, 3.3, -90),
    Item("chair", RIGHT - 1.1, 3.3, 90),
    Item("shelf", LEFT, 1.8, 90),
    Item("shelf", RIGHT, 1.85, -90),
    Item("shelf", RIGHT, 0.62 + THICKNESS, -90),
    Item("plant", LEFT + 0.55, 4.62, 0, 0, 0.9),
    Item("picture", LEFT, 3.3, 90, 1.45),
    Item("rug", 0, 3.0),
    Item("armchair", -0.35, 1.5, -35),
)
SINGLE_OFFICE = (
    Item("workplace", 0.2, 3.75, 180),
    Item("chair", 0.2, 4.4),
    Item("chair", -0.35, 2.75, 180),
    Item("chair", 0.7, 2.75, 180),
    Item("shelf", LEFT, 2.0, 90),
    Item("shelf", LEFT, 3.3, 90),
    Item("shelf", RIGHT, 0.62 + THICKNESS, -90),
    Item("shelf", RIGHT, 1.9, -90),
    Item("cabinet", RIGHT, 3.2, -90),
    Item("plant", RIGHT - 0.5, 4.62, 0, 0, 0.9),
    Item("other picture", 0.4, THICKNESS, 180, 1.3),
)
MEETING_ROOM = (
    Item("table", 0, 2.9, 90),
    *(Item("chair", -0.95, y, 90) for y in (2.1, 2.9, 3.7)),
    *(Item("chair", 0.95, y, -90) for y in (2.1, 2.9, 3.7)),
    Item("chair", 0, 4.45),
    Item("whiteboard", LEFT, 2.9, 90),
    Item("cabinet", RIGHT, 0.8, -90),
    Item("shelf", RIGHT, 4.4, -90),
    Item("plant", LEFT + 0.55, 4.62, 0, 0, 0.9),
    Item("picture", RIGHT, 2.6, -90, 1.3),
)
LIBRARY = (
    *(Item("shelf", LEFT, y, 90) for y in (1.9, 3.15, 4.4)),
    *(Item("shelf", RIGHT, y, -90) for y in (0.74, 1.99, 3.24, 4.49)),
    Item("workplace", 0, 4.2),
    Item("chair", 0, 3.5, 180),
    Item("armchair", 0.6, 1.7, 75),
    Item("plant", 0.55, 0.7, 0, 0, 0.9),
)
LAYOUTS = (DOUBLE_OFFICE, SINGLE_OFFICE, MEETING_ROOM, LIBRARY)
