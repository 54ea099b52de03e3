"""mlrt-compare parity SCENES...: the image of Mitsuba's `direct` with the same samples?"""

from __future__ import annotations

import argparse
import dataclasses
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from . import llvm
from .options import (
    COULD_NOT_RUN,
    FAILED,
    PASSED,
    PROGRAM,
    Parser,
    add_json,
    add_scene_choices,
    add_table,
    at_least,
    check_json,
    settings_of,
    write_json,
    write_text,
)
from .scene_files import common_folder, scenes_in, short_names, told_from
from .settings import Settings
from .shading_paths import on_each_path

PLACE = re.compile(r"( with id '[^']*')? at \S+ line [\d:]+")
"""Of an element in a message; the table says the scene already."""
Row = dict[str, Any]


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code, the worst of all scenes that are named;
    files of folders need not be scenes. Raises CannotRun."""
    options = parity_parser().parse_args(arguments)
    check_json(options.json)
    check_json(options.table)
    scenes = scenes_in(options.scenes)
    # Dr.Jit takes its libLLVM when it is first imported, which the modules below do.
    llvm.activate()
    from .machine import machine_of_comparison
    from .parity import parity

    base = common_folder(scenes)
    rows: list[Row] = []

    def write(more_to_come: bool) -> None:
        options_told = [w for w in arguments if Path(w) not in options.scenes]
        figures = {"options": options_told, "machine": machine_of_comparison()}
        told = told_from({**figures, "scenes": rows}, base)
        write_json(options.json, told, more_to_come=more_to_come)
        write_text(options.table, table(rows), more_to_come=more_to_come)

    code = PASSED
    for scene, name in zip(scenes, short_names(scenes), strict=True):
        on_paths, choice = paths_of(settings_of(options, scene, options.spp))
        for settings in on_paths:
            row: Row = {"name": name, "path": settings.shading, "auto": choice}
            try:
                row |= parity(settings).as_dict()
                row["code"] = PASSED if row["passed"] else FAILED
            except Exception as error:
                # A crash of one scene is a finding, and the others are still of interest.
                row |= {"code": COULD_NOT_RUN, "error": " ".join(str(error).split())}
            row = told_from(row, base)
            if any(
                old["name"] == name and old.get("error") == row.get("error", "")
                for old in rows
            ):
                continue  # of the scene, whatever the path
            rows.append(row)
            tell(row)
            if row["code"] != COULD_NOT_RUN or scene in options.scenes:
                code = max(code, row["code"])
            write(more_to_come=True)
    write(more_to_come=False)
    return code


def paths_of(settings: Settings) -> tuple[list[Settings], str]:
    """As `on_each_path`, but once for a scene that cannot be read."""
    from mlrt_plugin.errors import MlrtError

    try:
        return on_each_path(settings)
    except MlrtError:
        # Rendering it tells why.
        return [dataclasses.replace(settings, shading="auto")], ""


def tell(row: Row) -> None:
    """A line for each scene and path as it is done."""
    what = f"{row['name']}, {row['path']}"
    if "error" in row:
        print(f"{PROGRAM}: {what}: {row['error']}", file=sys.stderr, flush=True)
        return
    print(
        f"{'PASS' if row['passed'] else 'FAIL'} {what}: RMSE {row['rmse']:.1e} of the mean "
        f"outside of {row['disputed_pixels'] + row['rounded_pixels']} pixels, "
        f"{row['judgement']['rays']} of {row['rays']} rays answered otherwise",
        flush=True,
    )


def table(rows: Sequence[Row]) -> str:
    """All results as Markdown."""
    lines = [
        "| scene | path | because | samples | load, build, first, steady (s) "
        "| Mitsuba's first, steady (s) | rays, of these answered otherwise "
        "| both right, MLRT, Embree, not judged | such pixels, by rounding "
        "| others that differ | RMS of all others | |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    refused = []
    for row in rows:
        path, _, because = row["auto"].partition(", because ")
        if "error" in row:
            refused.append(f"- {row['name']}: {row['error']}")
            continue
        judged = row["judgement"]
        verdicts = ("both_right", "only_ours", "only_theirs", "not_judged")
        # What `auto` takes has a reason; the other path has been asked for.
        reason = PLACE.sub("", because) if row["path"] == path else "asked for"
        seconds = [row[key] for key in ("load", "build", "first", "steady")]
        theirs = [row[key] for key in ("mitsuba_first", "mitsuba_steady")]
        lines.append(
            f"| {row['name']} | {row['path']} | {reason} | {row['integrator']} "
            f"| {', '.join(f'{s:.2g}' for s in seconds)} "
            f"| {', '.join(f'{s:.2g}' for s in theirs)} "
            f"| {row['rays']}, {judged['rays']} "
            f"| {', '.join(str(judged[key]) for key in verdicts)} "
            f"| {row['disputed_pixels']}, {row['rounded_pixels']} "
            f"| {row['differing_pixels']} | {row['rmse']:.1e} "
            f"| {'pass' if row['passed'] else 'FAIL'} |"
        )
    if refused:
        lines += ["", "Not rendered:", "", *refused]
    return "\n".join(lines) + "\n"


def parity_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=f"{PROGRAM} parity",
        description="Renders scenes with MLRT, on each path that they can take, and with "
        "Mitsuba's llvm_ad_rgb: direct illumination, the same samples. Traces every ray of "
        "the image with Embree as well, sets apart the pixels in which a ray is answered "
        "in another way, and lets exact arithmetic judge those rays. The images must agree "
        "in all other pixels: a root mean square of 1e-4 of the mean.",
        epilog="Exit codes: 0 all images agree, 2 one does not, 4 one could not be "
        "rendered. Files of a folder need not be scenes.",
    )
    parser.add_argument(
        "scenes",
        type=Path,
        nargs="+",
        metavar="SCENE|FOLDER",
        help="XML files, or folders of such",
    )
    add_scene_choices(parser)
    parser.add_argument("--spp", type=at_least(1), help="samples a pixel (the scene's)")
    add_table(parser)
    add_json(parser)
    return parser
