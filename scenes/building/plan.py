"""The plan of the building: which rooms there are, what is in them, how many books."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import building.pieces as pieces
import building.shell as shell
import numpy as np
from building.instances import (
    Assembly,
    Floats,
    Places,
    places,
    prototype,
    rotated,
    within,
)
from building.rooms import EVERY_ROOM, LAYOUTS, LOOSE, PIECES, Item
from numpy.typing import NDArray

BAYS_BETWEEN_FIRE_DOORS = 5
FEWEST_BAYS = 2
TRIANGLES_A_ROOM = 17_000
"""Of a room with its books on average; only the shape of the building depends on it."""
BAYS_A_STOREY = 3.4
"""Bays of a storey for each storey: the proportions of the building."""
OPEN_DOORS = 0.3
"""Share of the doors out of sight that stand open."""

BOOKS = ("red", "green", "blue", "yellow", "white", "fabric", "terracotta", "dark_wood")
BOOKS_A_BOARD = 28
BOOK_TRIANGLES = 12


class Plan(NamedTuple):
    storeys: int
    bays: int
    """Of a storey."""

    @property
    def view(self) -> tuple[int, int]:
        """Storey and bay in which the camera stands."""
        part = self.bays // BAYS_BETWEEN_FIRE_DOORS // 2
        return self.storeys // 2, BAYS_BETWEEN_FIRE_DOORS * part

    @property
    def rooms(self) -> NDArray[np.int64]:
        """(n, 3): storey, bay, and 0 for the south, 1 for the north side of the
        corridor."""
        return np.indices((self.storeys, self.bays, 2)).reshape(3, -1).T


class Draft(NamedTuple):
    """A building whose shelves are empty."""

    assembly: Assembly
    shelves: Places

    @property
    def capacity(self) -> int:
        """Triangles of the books that the shelves hold."""
        boards = len(self.shelves.feet) * (len(pieces.SHELF_BOARDS) - 1)
        return boards * BOOKS_A_BOARD * BOOK_TRIANGLES


def room_places(rooms: NDArray[np.int64]) -> Places:
    """Frames of rooms told as in `Plan.rooms`."""
    storey, bay, north = rooms.T
    side = 2 * north - 1
    feet = np.column_stack(
        [(bay + 0.5) * shell.BAY, side * shell.CORRIDOR / 2, storey * shell.STOREY]
    )
    return places(feet, np.where(north == 1, 0.0, np.pi))


def furnish(
    draft: Assembly, rooms: Places, items: tuple[Item, ...], chance: np.random.Generator
) -> list[Places]:
    """Puts the same things into rooms; returns the places of their shelves."""
    shelves = []
    for item in items:
        place = places((item.x, item.y, item.z), math.radians(item.turn), item.size)
        where = within(rooms, place)
        loose = math.radians(LOOSE.get(item.piece, 0.0))
        turns = where.turns + chance.uniform(-loose, loose, len(where.turns))
        where = where._replace(turns=turns)
        draft.add(PIECES[item.piece], where)
        if item.piece == "shelf":
            shelves.append(where)
    return shelves


def draft(plan: Plan, seed: int) -> Draft:
    """The building without books."""
    chance = np.random.default_rng([seed, 0])
    assembly = Assembly()
    rooms = plan.rooms
    layout = chance.permutation(np.arange(len(rooms)) % len(LAYOUTS))
    wide = np.zeros(len(rooms), bool)
    swing = np.where(
        chance.random(len(rooms)) < OPEN_DOORS, chance.uniform(0.3, 1.7, len(rooms)), 0.0
    )
    storey, bay = plan.view
    near = (rooms[:, 0] == storey) & (abs(rooms[:, 1] - bay - 2) <= 3)
    swing[near] = 0.0
    for ahead, north, kind, open_wide, angle in SEEN:
        here = (rooms == (storey, bay + ahead, north)).all(axis=1)
        layout[here], wide[here], swing[here] = kind, open_wide, angle

    where = room_places(rooms)

    def chosen(mask: NDArray[np.bool_]) -> Places:
        return Places(*(x[mask] for x in where))

    assembly.add(prototype(shell.room("door")), chosen(~wide))
    assembly.add(prototype(shell.room("wide")), chosen(wide))
    doors = chosen(~wide)
    hinge = places((shell.DOOR[0] + 0.045, shell.THICKNESS - 0.04, 0))
    leaves = within(doors, hinge)
    leaves = leaves._replace(turns=leaves.turns + swing[~wide])
    assembly.add(PIECES["door leaf"], leaves)
    shelves = furnish(assembly, where, EVERY_ROOM, chance)
    for kind, items in enumerate(LAYOUTS):
        shelves += furnish(assembly, chosen(layout == kind), items, chance)
    add_corridors(assembly, plan)
    return Draft(assembly, Places(*map(np.concatenate, zip(*shelves, strict=True))))


SEEN = (
    (1, 0, 0, True, 0.0),
    (2, 0, 2, True, 0.0),
    (2, 1, 3, False, 1.5),
    (3, 0, 1, False, 1.5),
)
"""Rooms that the camera looks into: bays ahead of it, side, layout, whether the opening is
wide, the door's angle in radians."""


def add_corridors(assembly: Assembly, plan: Plan) -> None:
    """Corridors with what stands in them, and the walls that are no room's own."""
    storey, bay = np.indices((plan.storeys, plan.bays)).reshape(2, -1)
    x, z = (bay + 0.5) * shell.BAY, storey * shell.STOREY
    middle = places(np.column_stack([x, 0 * x, z]))
    assembly.add(PIECES["corridor"], middle)
    for piece, at, turn in (
        ("ceiling lamp", (0, 0, shell.HEIGHT), 0.0),
        ("picture", (0.9, shell.CORRIDOR / 2, 1.3), 0.0),
    ):
        assembly.add(PIECES[piece], within(middle, places(at, turn)))
    for piece, rest, at in (
        ("bench", 0, (1.0, shell.CORRIDOR / 2, 0.0)),
        ("plant", 2, (1.1, shell.CORRIDOR / 2 - 0.4, 0.0)),
        ("cabinet", 3, (1.0, shell.CORRIDOR / 2, 0.0)),
    ):
        some = Places(*(v[bay % BAYS_BETWEEN_FIRE_DOORS == rest] for v in middle))
        size = 0.7 if piece == "plant" else 1.0
        assembly.add(PIECES[piece], within(some, places(at, 0.0, size)))

    floors = np.arange(plan.storeys) * shell.STOREY
    length = plan.bays * shell.BAY

    def lines(xs: NDArray[np.floating[Any]], y: float, turn: float) -> Places:
        grid = np.stack(np.meshgrid(xs, [y], floors, indexing="ij"), axis=-1)
        return places(grid.reshape(-1, 3), turn)

    between = np.arange(1, plan.bays) * shell.BAY
    wall = prototype(shell.partition())
    assembly.add(wall, lines(between, shell.CORRIDOR / 2, 0.0))
    assembly.add(wall, lines(between, -shell.CORRIDOR / 2, math.pi))
    fire = between[BAYS_BETWEEN_FIRE_DOORS - 1 :: BAYS_BETWEEN_FIRE_DOORS]
    assembly.add(prototype(shell.fire_door()), lines(fire, 0.0, 0.0))
    gable = prototype(shell.gable())
    assembly.add(gable, lines(np.array([length]), 0.0, 0.0))
    assembly.add(gable, lines(np.zeros(1), 0.0, math.pi))
    roof = prototype(shell.roof(plan.bays))
    assembly.add(roof, places((0, 0, plan.storeys * shell.STOREY)))


def plan_for(triangles: int, seed: int) -> tuple[Plan, Draft]:
    """The building whose rooms, with more or fewer books, have this many triangles."""
    rooms = triangles / TRIANGLES_A_ROOM
    storeys = max(round(math.sqrt(rooms / (2 * BAYS_A_STOREY))), 1)
    plan = Plan(storeys, max(round(rooms / (2 * storeys)), FEWEST_BAYS))
    made = draft(plan, seed)
    while made.assembly.triangles > triangles and plan.bays > FEWEST_BAYS:
        plan = plan._replace(bays=plan.bays - 1)
        made = draft(plan, seed)
    while made.assembly.triangles + made.capacity < triangles:
        longer = plan._replace(bays=plan.bays + 1)
        more = draft(longer, seed)
        # In a small building one more bay may miss by more than shelves that are full.
        short = triangles - made.assembly.triangles - made.capacity
        if more.assembly.triangles - triangles > short:
            break
        plan, made = longer, more
    return plan, made


def add_books(made: Draft, triangles: int, seed: int) -> None:
    """Fills the shelves, each board from the left, until the building has ``triangles``
    triangles."""
    chance = np.random.default_rng([seed, 1])
    count = max(triangles - made.assembly.triangles, 0) // BOOK_TRIANGLES
    boards = len(pieces.SHELF_BOARDS) - 1
    shape = (len(made.shelves.feet), boards, BOOKS_A_BOARD)
    thick = chance.uniform(0.6, 1.4, shape)
    inside = pieces.SHELF_WIDTH - 2 * pieces.BOARD - 0.02
    thick *= inside / thick.sum(axis=2, keepdims=True)
    tall = chance.uniform(0.62, 0.95, shape) * 0.35
    deep = chance.uniform(0.6, 0.9, shape) * pieces.SHELF_DEPTH
    left = np.cumsum(thick, axis=2) - thick + 0.01 - inside / 2
    low = np.asarray(pieces.SHELF_BOARDS[:-1])[None, :, None] + pieces.BOARD
    feet = np.stack(np.broadcast_arrays(left, deep - 0.93 * pieces.SHELF_DEPTH, low), -1)
    sizes = np.stack([thick - 0.002, deep, tall], axis=-1)

    # Boards fill at their own pace; of all books the first `count` to be put there.
    pace = chance.uniform(0.6, 1.6, shape[:2])[..., None]
    order = (np.arange(BOOKS_A_BOARD) + 1) / pace
    bought = np.sort(np.argsort(order, axis=None, kind="stable")[:count])
    shelf = bought // (boards * BOOKS_A_BOARD)
    local = feet.reshape(-1, 3)[bought]
    turns = made.shelves.turns[shelf]
    where = Places(
        made.shelves.feet[shelf] + rotated(local, turns),
        turns,
        sizes.reshape(-1, 3)[bought],
    )
    colour = chance.integers(0, len(BOOKS), order.size)[bought]
    for i, name in enumerate(BOOKS):
        book = prototype(pieces.book(name))
        made.assembly.add(book, Places(*(x[colour == i] for x in where)))


def building(triangles: int, seed: int) -> tuple[Plan, Assembly]:
    """A furnished building of about ``triangles`` triangles, and its plan."""
    plan, made = plan_for(triangles, seed)
    add_books(made, triangles, seed)
    return plan, made.assembly


def room_centres(plan: Plan) -> Floats:
    """A point above the furniture in the middle of every room of `Plan.rooms`, (n, 3)."""
    above = places((0.7, shell.FAR / 2, shell.HEIGHT - 0.15))
    return within(room_places(plan.rooms), above).feet
