"""mlrt-compare paper: the tables of the MLRTA paper on scenes of the same sizes."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from mlrt_files import replacing

from .bench.options import counts, names
from .options import (
    FAILED,
    PASSED,
    PROGRAM,
    CannotRun,
    Parser,
    at_least,
    check_output_folder,
)

FIGURES = "paper.json"
RESOLUTION, REPEATS = 1024, 15
QUICK_RESOLUTION, QUICK_REPEATS = 128, 2
QUICK_TILES = ((32, 128), (8, 32))
"""ITS and MTS that are tried."""


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code. Raises CannotRun."""
    options = paper_parser().parse_args(arguments)
    folder: Path = options.output
    check_output_folder(folder)

    from .bench.errors import BenchError
    from .bench.status import show_status
    from .paper.study import measured, sound

    try:
        figures = read_figures(folder) if options.redraw else measure(options, folder)
        if not measured(figures):
            raise CannotRun(f"{folder / FIGURES} has no scene that was measured to the end")
        paths = write_pages(folder, figures)
    except BenchError as error:
        raise CannotRun(str(error)) from error
    except OSError as error:
        raise CannotRun(f"{folder} cannot be written to: {error.strerror}") from error
    finally:
        show_status("")
    print("wrote " + ", ".join(map(str, paths)))
    return PASSED if sound(figures) else FAILED


def measure(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """All figures, which are kept in the folder part by part. Raises BenchError."""
    from .bench.checkout import find_checkout
    from .bench.figures import measure_scenes, new_figures
    from .bench.figures import write_json as keep
    from .bench.machine import machine_record
    from .bench.options import default_cache
    from .paper.scenes import paper_scenes
    from .paper.study import PARTS, add_part, study

    plan = plan_of(options)
    source = find_checkout(options.source)
    scenes = paper_scenes(source, options.scenes)
    folder.mkdir(exist_ok=True)
    kept = folder / FIGURES
    cache = options.cache or default_cache()
    figures = new_figures("paper", machine_record(source, None), asdict(plan))
    if options.resume or options.again:
        figures["scenes"] = scenes_to_keep(folder, figures, bool(options.again))
    done = {scene["name"]: scene for scene in figures["scenes"]}

    def measure_parts(loaded: Any, scene: dict[str, Any], parts: Sequence[str]) -> None:
        for part in study(loaded, plan, figures["machine"]["commit"], scene, parts):
            add_part(scene, part)
            keep(kept, figures)

    for scene in scenes:
        if options.again and scene.name in done:
            measure_parts(scene.load(cache), done[scene.name], options.again)
    missing = [scene for scene in scenes if scene.name not in done]
    if missing:
        measure_scenes(
            figures,
            missing,
            lambda chosen: chosen.load(cache),
            lambda loaded, scene: measure_parts(loaded, scene, PARTS),
            kept,
        )
    return figures


def scenes_to_keep(
    folder: Path, figures: dict[str, Any], parts_anew: bool
) -> list[dict[str, Any]]:
    """Those that an earlier run has measured to the end, if there was one.

    parts_anew: whether some parts are to be measured again, which may be at another commit
    and with other repeats, as the page tells. Raises CannotRun if the earlier run had
    other settings, another machine or, unless parts_anew, another commit, as then its
    figures do not belong to those to come.
    """
    from .paper.study import measured

    if not (folder / FIGURES).is_file():
        return []
    earlier = read_figures(folder)
    settings, machine = figures["settings"].keys(), ["processor", "isa", "commit", "mlrt"]
    if parts_anew:
        settings, machine = {"resolution", "tiles"}, ["processor", "isa"]
    for part, keys in (("settings", settings), ("machine", machine)):
        for name in keys:
            was, now = (json_value(each[part].get(name)) for each in (earlier, figures))
            if was != now:
                raise CannotRun(
                    f"{folder / FIGURES} was measured with another {name}, {was} and not "
                    f"{now}: measure into another folder"
                )
    return measured(earlier)


def json_value(value: Any) -> Any:
    """As it comes back from a file."""
    return json.loads(json.dumps(value))


def read_figures(folder: Path) -> dict[str, Any]:
    """What an earlier run kept. Raises CannotRun if that cannot be read."""
    path = folder / FIGURES
    try:
        figures = json.loads(path.read_text())
    except OSError as error:
        raise CannotRun(f"{path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise CannotRun(f"{path} cannot be read: {error}") from error
    if not (isinstance(figures, dict) and figures.get("benchmark") == "paper"):
        raise CannotRun(f"{path} was not written by {PROGRAM} paper")
    return figures


def write_pages(folder: Path, figures: dict[str, Any]) -> list[Path]:
    """Writes what is drawn from the figures, and prints the tables; returns the paths."""
    from .paper.plots import plots
    from .paper.text import markdown

    text = markdown(figures)
    print(text)
    pages = {"paper.md": text.encode()}
    pages |= {f"{name}.png": picture for name, picture in plots(figures)}
    for name, content in pages.items():
        with replacing(folder / name) as temporary:
            temporary.write_bytes(content)
    return [folder / name for name in pages]


def plan_of(options: argparse.Namespace) -> Any:
    from .paper.study import Plan
    from .paper.tile_sweep import Tiles

    quick = options.quick
    return Plan(
        threads=options.threads,
        resolution=options.resolution or (QUICK_RESOLUTION if quick else RESOLUTION),
        repeats=options.repeats or (QUICK_REPEATS if quick else REPEATS),
        tiles=Tiles(*QUICK_TILES) if quick else Tiles(),
    )


def parts(text: str) -> tuple[str, ...]:
    from .paper.study import PARTS

    chosen = [name.strip() for name in text.split(",")]
    for name in chosen:
        if name not in PARTS:
            raise argparse.ArgumentTypeError(
                f"there is no part '{name}': choose from {', '.join(PARTS)}"
            )
    return tuple(part for part in PARTS if part in chosen)


def paper_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=f"{PROGRAM} paper",
        description="Repeats tables 1, 2 and 3 of the MLRTA paper (Reshetov, Soupikov and "
        "Hurley 2005) on scenes of the same sizes, beside the published figures: steps "
        "through the tree and tests of triangles, with and without entry points, for "
        "primary and shadow rays. Scenes that are not there are skipped by name.",
        epilog="Exit codes: 0 done; 2 ways through the tree gave different hits; 4 could "
        "not run.",
    )
    parser.add_argument(
        "--scenes",
        type=names,
        metavar="A,B",
        help="of office, conference, building, dragon-2.2M and dragon, or XML files "
        "(office,conference,building,dragon)",
    )
    parser.add_argument(
        "--threads",
        type=counts,
        default=(1, 2),
        metavar="N,M",
        help="numbers of them that frames are timed with (1,2)",
    )
    parser.add_argument(
        "--resolution",
        type=at_least(16, 2**14),
        metavar="N",
        help=f"pixels along both sides of the frame ({RESOLUTION}, the paper's)",
    )
    parser.add_argument(
        "--repeats",
        type=at_least(1, 2**14),
        metavar="N",
        help=f"frames of each that are timed ({REPEATS})",
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help=f"a trial: {QUICK_RESOLUTION} pixels, {QUICK_REPEATS} frames, unless told",
    )
    parser.add_argument(
        "--continue",
        dest="resume",
        action="store_true",
        help=f"keep the scenes that {FIGURES} in the folder has to the end, and measure "
        "the others only",
    )
    parser.add_argument(
        "--again",
        type=parts,
        metavar="PART,...",
        help="measure these parts of scenes that the folder has to the end once more, and "
        "keep their others, be they of another commit: counts, grouping, rates (frames a "
        "second), culling, tiles, trees. Scenes that it does not have are measured as a "
        "whole",
    )
    parser.add_argument(
        "--redraw",
        action="store_true",
        help=f"tables and plots anew, from {FIGURES} of an earlier run in the folder",
    )
    parser.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        help="folder for generated scenes (~/.cache/mlrt-bench)",
    )
    parser.add_argument(
        "--source",
        type=Path,
        metavar="DIR",
        help="MLRT's source checkout, which has the scenes (the current one)",
    )
    parser.add_argument(
        "-o",
        dest="output",
        type=Path,
        default=Path("paper"),
        metavar="DIR",
        help="folder for tables, figures and plots, made if its parent exists (paper)",
    )
    return parser
