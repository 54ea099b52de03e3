"""Writes the building: an office building of several storeys, and its XML.

    python generate.py [--triangles N] [--seed S] [-o FOLDER]

Furnished rooms on both sides of corridors, which fire doors divide. The camera stands in a
corridor and looks into four rooms; all others are behind walls and closed doors. The number
of rooms follows from the number of triangles, and books on the shelves make up the rest.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from building.plan import Plan, building
from building.shell import BAY, STOREY
from scene_output import Request, View, ply, point_light, run, scene_xml, write_files

SIZES = (60_000, 2_200_000, 20_000_000)

COLOURS = {
    "wall": (0.76, 0.73, 0.66),
    "ceiling": (0.84, 0.84, 0.82),
    "floor": (0.45, 0.42, 0.38),
    "carpet": (0.33, 0.36, 0.42),
    "rug": (0.38, 0.12, 0.10),
    "trim": (0.80, 0.79, 0.76),
    "sky": (0.55, 0.72, 0.90),
    "wood": (0.56, 0.37, 0.20),
    "dark_wood": (0.28, 0.17, 0.09),
    "metal": (0.45, 0.46, 0.48),
    "plastic": (0.09, 0.09, 0.10),
    "screen": (0.14, 0.30, 0.46),
    "fabric": (0.12, 0.25, 0.40),
    "terracotta": (0.58, 0.27, 0.16),
    "white": (0.86, 0.86, 0.85),
    "red": (0.60, 0.13, 0.10),
    "green": (0.14, 0.36, 0.16),
    "blue": (0.13, 0.22, 0.50),
    "yellow": (0.76, 0.58, 0.16),
}


def view(plan: Plan) -> View:
    storey, bay = plan.view
    x, z = bay * BAY, storey * STOREY
    return View(76, (x + 3.8, 0.95, z + 1.65), (x + 6.8, -1.15, z + 1.35))


def lights(plan: Plan) -> str:
    """Lamps of the corridor and of the rooms that are seen."""
    storey, bay = plan.view
    x, z = bay * BAY, storey * STOREY + 2.45
    far = min(2.6, plan.bays - bay - 0.4) * BAY
    lamps = (
        ("corridor", (x + 2.9, 0.2, z), (8, 7.6, 6.8)),
        (
            "far-corridor",
            (x + far, 0.0, z),
            (9, 8.4, 7.4),
        ),
        ("office", (x + 1.45 * BAY, -3.4, z), (18, 17.2, 15.8)),
        ("meeting-room", (x + 2.5 * BAY, -3.6, z), (15, 14, 12.4)),
    )
    return "".join(point_light(*lamp) for lamp in lamps)


def write(request: Request) -> str:
    """Writes building.xml and meshes/*.ply; returns what was written."""
    plan, assembly = building(request.triangles, request.seed)

    def files() -> Iterator[tuple[str, bytes]]:
        for name in COLOURS:
            yield f"meshes/{name}.ply", ply(*assembly.mesh(name))
        yield "building.xml", scene_xml(view(plan), lights(plan), COLOURS)

    write_files(request.folder, files())
    return (
        f"{request.folder / 'building.xml'}: {assembly.triangles} triangles, "
        f"{len(plan.rooms)} rooms on {plan.storeys} storeys"
    )


if __name__ == "__main__":
    run(
        "Writes the building: furnished rooms of which a few are seen.",
        Path(__file__).parent,
        SIZES,
        write,
    )
