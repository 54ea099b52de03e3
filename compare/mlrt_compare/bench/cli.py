"""The command mlrt-bench.

Exit codes: 0 done, 2 MLRT's own trees disagree, 4 the benchmark could not be made, 130
interrupted. With ``MLRT_DEBUG`` set in the environment, errors come with a traceback.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from .errors import BenchError
from .status import show_status

if TYPE_CHECKING:
    from .build import SceneBenchmark

DONE, DISAGREE, COULD_NOT_RUN, INTERRUPTED = 0, 2, 4, 130
PROGRAM = "mlrt-bench"
FORMAT_VERSION = 1
"""Of the JSON file."""


class Parser(argparse.ArgumentParser):
    """Reports a wrong call in one sentence, with the exit code for what could not run."""

    def error(self, message: str) -> NoReturn:
        raise BenchError(f"{message} (see {self.prog} --help)")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code. ``argv`` is without the program's
    name."""
    try:
        options = make_parser().parse_args(argv)
        run: Callable[[argparse.Namespace], int] = options.run
        return run(options)
    except BenchError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return COULD_NOT_RUN
    except KeyboardInterrupt:
        show_status("")
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        message = " ".join(str(error).split())
        print(f"{PROGRAM}: {type(error).__name__}: {message}", file=sys.stderr)
        return COULD_NOT_RUN


def make_parser() -> Parser:
    parser = Parser(
        prog=PROGRAM,
        description="Benchmarks of MLRT beside Embree 3 of the mitsuba wheel, in one "
        "process and in turns. The native side is compiled when it is first needed.",
        epilog="Exit codes: 0 done, 2 MLRT's own trees disagree, 4 could not run.",
    )
    commands = parser.add_subparsers(dest="command", required=True, parser_class=Parser)
    build = commands.add_parser(
        "build",
        help="seconds and bytes of trees and of the first frame with them",
        description="Builds MLRT's trees and Embree's hierarchies and renders a frame with "
        "each.",
    )
    build.set_defaults(run=run_build)
    build.add_argument("--json", type=Path, metavar="FILE", help="write all figures there")
    build.add_argument(
        "--scenes",
        type=names,
        metavar="A,B",
        help="names of usual scenes or XML files (all usual ones)",
    )
    build.add_argument(
        "--threads",
        type=counts,
        default=(1, 2),
        metavar="N,M",
        help="numbers of them (1,2)",
    )
    build.add_argument(
        "--repeats", type=count, default=5, metavar="N", help="runs of each (%(default)s)"
    )
    build.add_argument(
        "--resolution",
        type=count,
        default=1024,
        metavar="N",
        help="pixels along both sides of the frame (%(default)s)",
    )
    build.add_argument(
        "--images", type=Path, metavar="DIR", help="write the frames of both engines there"
    )
    build.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        help="folder for generated scenes and the native side (~/.cache/mlrt-bench)",
    )
    build.add_argument(
        "--source",
        type=Path,
        metavar="DIR",
        help="MLRT's source checkout (the current one)",
    )
    return parser


def run_build(options: argparse.Namespace) -> int:
    check_outputs(options)
    # Imported late: a wrong call is answered without loading Mitsuba.
    from . import build_table
    from .build import SceneBenchmark, Settings
    from .checkout import find_checkout
    from .machine import machine_record
    from .native import load_native
    from .scenes import chosen_scenes

    check_threads(options.threads)
    source = find_checkout(options.source)
    scenes = chosen_scenes(options.scenes, source)
    cache = options.cache or default_cache()
    native = load_native(source, cache)
    settings = Settings(options.threads, options.repeats, options.resolution)
    figures: dict[str, Any] = {
        "benchmark": "build",
        "version": FORMAT_VERSION,
        "machine": machine_record(source, native),
        "settings": {
            "threads": list(settings.threads),
            "repeats": settings.repeats,
            "resolution": settings.resolution,
        },
        "scenes": [],
    }
    show(build_table.machine_lines(figures["machine"], figures["settings"]))
    for scene_source in scenes:
        scene: dict[str, Any] = {"name": scene_source.name, "skipped": None}
        figures["scenes"].append(scene)
        try:
            loaded = scene_source.load(cache)
        except BenchError as error:
            scene["skipped"] = str(error)
            show(["", f"{scene_source.name}: skipped, {error}"])
            write_json(options.json, figures)
            continue
        scene |= {"triangles": len(loaded.faces), "blocks": []}
        benchmark = SceneBenchmark(native, loaded, settings)
        for block in benchmark.blocks():
            scene["blocks"].append(block)
            scene |= benchmark.summary()
            show(build_table.block_lines(scene, block))
        show(build_table.scene_lines(scene))
        write_images(options.images, scene["name"], benchmark)
        # After each scene, so that an interrupted run leaves what it found out.
        write_json(options.json, figures)
    show(build_table.goal_lines(figures["scenes"]))
    measured = [scene for scene in figures["scenes"] if scene["skipped"] is None]
    if not measured:
        raise BenchError("none of the scenes is there: nothing was measured")
    agree = all(scene["agreement"]["mlrt_trees_give_one_image"] for scene in measured)
    return DONE if agree else DISAGREE


def show(lines: list[str]) -> None:
    for line in lines:
        print(line, flush=True)


def write_json(path: Path | None, figures: dict[str, Any]) -> None:
    from mlrt_plugin.image_files import replacing

    if path is None:
        return
    try:
        with replacing(path) as temporary:
            temporary.write_text(json.dumps(figures, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        raise BenchError(f"{path} cannot be written: {error.strerror}") from error


def write_images(folder: Path | None, scene: str, benchmark: SceneBenchmark) -> None:
    import numpy as np

    from mlrt_plugin.errors import MlrtError
    from mlrt_plugin.image_files import write_image

    if folder is None:
        return
    folder.mkdir(exist_ok=True)
    for name, frame in benchmark.frames.items():
        path = folder / f"{scene}-{name.replace(' ', '-').lower()}.png"
        try:
            write_image(path, np.repeat(frame.image[..., None], 3, axis=2))
        except MlrtError as error:
            raise BenchError(str(error)) from error


def check_outputs(options: argparse.Namespace) -> None:
    """Raises BenchError for outputs that could not be written after all the work."""
    if options.json is not None and options.json.is_dir():
        raise BenchError(f"the file {options.json} to write figures to is a folder")
    for path in (options.json, options.images):
        if path is not None and not path.absolute().parent.is_dir():
            raise BenchError(f"there is no folder {path.parent} to write {path} to")
    if options.images is not None and options.images.is_file():
        raise BenchError(f"{options.images} to write images to is not a folder")


def check_threads(threads: Sequence[int]) -> None:
    """Raises BenchError for more threads than Embree can be built with."""
    # Its tasks' storage has room for twice the processors (taskschedulerinternal.h).
    limit = 2 * (os.cpu_count() or 1)
    if max(threads) > limit:
        raise BenchError(
            f"{max(threads)} threads are too many: Embree takes at most {limit} on this "
            "machine"
        )


def default_cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "mlrt-bench"


def names(text: str) -> list[str]:
    found = [name.strip() for name in text.split(",") if name.strip()]
    if not found:
        raise argparse.ArgumentTypeError("no scene is named")
    return list(dict.fromkeys(found))


def count(text: str) -> int:
    limit = 2**14
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 1 <= value <= limit:
        raise argparse.ArgumentTypeError(f"{value} is not from 1 to {limit}")
    return value


def counts(text: str) -> tuple[int, ...]:
    return tuple(dict.fromkeys(count(part) for part in text.split(",")))
