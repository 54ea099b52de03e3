"""The command `mlrt-bench offsets`: pixels that shadow rays get wrong, by size of the
scene."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as Pillow

from mlrt_files import replacing
from mlrt_plugin.options import SHADOW_OFFSETS
from mlrt_plugin.render import PreparedScene, prepare

from .checkout import find_checkout
from .errors import BenchError
from .figures import new_figures, show, write_json
from .machine import machine_record
from .offset_scene import LIGHTS, Placement, hard_scene
from .offset_truth import Judgement, judge, traced_segments, visible
from .status import show_status

PLACEMENTS = (
    *(Placement(size=10.0**exponent) for exponent in range(-6, 7)),
    *(Placement(shift=10.0**exponent) for exponent in range(1, 6)),
)
MARKS = {1: (1.0, 0.0, 0.0), 2: (0.0, 1.0, 0.0), 3: (0.3, 0.3, 1.0)}
"""Of acne, leaks and what is not decided, red, green and blue."""

Picture = npt.NDArray[np.uint8]


def run(options: argparse.Namespace) -> bool:
    """Returns whether nothing is wrong with robust offsets wherever the scene is not moved
    out of the reach of single precision."""
    source = find_checkout(options.source)
    if options.images is not None:
        options.images.mkdir(exist_ok=True)
    settings = {"resolution": options.resolution}
    figures = new_figures("offsets", machine_record(source, None), settings)
    for light in LIGHTS:
        rows = []
        for placement in PLACEMENTS:
            show_status(f"{light}, {placement.name}")
            judgements, pictures = measure(light, placement, options.resolution)
            rows.append(figures_of(placement, judgements))
            if options.images is not None:
                write_picture(options.images, light, placement, pictures)
        show_status("")
        figures["scenes"].append({"name": light, "skipped": None, "rows": rows})
        show(table_lines(light, rows))
        write_json(options.json, figures)
    return all(
        row["robust"]["acne"] + row["robust"]["leaks"] == 0
        for scene in figures["scenes"]
        for row in scene["rows"]
        if row["shift"] == 0
    )


def measure(
    light: str, placement: Placement, resolution: int, subdivisions: int = 3
) -> tuple[dict[str, Judgement], list[Picture]]:
    """Judges an image with each offset, and draws what is wrong into it."""
    prepared = prepare(
        hard_scene(light, placement, resolution, subdivisions), shading="native"
    )
    assert isinstance(prepared, PreparedScene)
    results = {
        name: prepared.render(shadow_offset=name, aovs=("prim",)) for name in SHADOW_OFFSETS
    }
    segments = traced_segments(prepared, results["robust"].aovs["prim"])
    expected = visible(prepared, segments)
    judgements, pictures = {}, []
    for name, result in results.items():
        judgements[name] = judge(prepared, segments, expected, result.image)
        pictures.append(marked(result.image, judgements[name].marks))
    return judgements, pictures


def marked(image: npt.NDArray[np.float32], marks: npt.NDArray[np.int8]) -> Picture:
    white = float(np.percentile(image, 99)) or 1.0
    colours = np.clip(image / white, 0, 1) ** (1 / 2.2)
    for mark, colour in MARKS.items():
        colours[marks == mark] = colour
    picture: Picture = (255 * colours + 0.5).astype(np.uint8)
    return picture


def write_picture(
    folder: Path, light: str, placement: Placement, pictures: Sequence[Picture]
) -> None:
    name = f"{light}-{placement.size:g}-{placement.shift:g}.png"
    try:
        with replacing(folder / name) as temporary:
            picture = Pillow.fromarray(np.concatenate(pictures, axis=1))
            picture.save(temporary, format="PNG")
    except OSError as error:
        raise BenchError(f"{folder / name} cannot be written: {error.strerror}") from error


def figures_of(placement: Placement, judgements: dict[str, Judgement]) -> dict[str, Any]:
    row: dict[str, Any] = {"size": placement.size, "shift": placement.shift}
    for name, judgement in judgements.items():
        row |= {"lit": judgement.lit, "dark": judgement.dark}
        row[name] = {
            "acne": judgement.acne,
            "leaks": judgement.leaks,
            "undecided": judgement.undecided,
        }
    return row


def table_lines(light: str, rows: list[dict[str, Any]]) -> list[str]:
    """Markdown: wrong pixels by size of the scene and offset."""
    head = [f"{name}: acne | leaks | undecided" for name in SHADOW_OFFSETS]
    lines = ["", f"{light} light", ""]
    lines.append(f"| size | lit | dark | {' | '.join(head)} |")
    lines.append("|---|" + "--:|" * (2 + 3 * len(SHADOW_OFFSETS)))
    for row in rows:
        cells = [Placement(row["size"], row["shift"]).name, row["lit"], row["dark"]]
        for name in SHADOW_OFFSETS:
            cells += [row[name][key] for key in ("acne", "leaks", "undecided")]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return lines
