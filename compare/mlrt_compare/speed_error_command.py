"""mlrt-compare speed-error SCENE: error over time of both renderers."""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mlrt_files import put_in_place

from . import llvm
from .options import (
    FAILED,
    PASSED,
    PROGRAM,
    CannotRun,
    Parser,
    add_output_options,
    add_scene_options,
    at_least,
    check_json,
    check_output_folder,
    settings_of,
    write_json,
)
from .scene_command import show_warning
from .timing import LEAST_SECONDS

DEFAULT_SPP = (1, 2, 4, 8, 16, 32, 64)
DEFAULT_ROUNDS = 16
"""Many short runs tell the expected error and its spread (Celarek et al. 2019)."""
REFERENCE_FACTOR = 64


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code. Raises CannotRun."""
    options = speed_error_parser().parse_args(arguments)
    settings = settings_of(options, options.scene, None)
    folder: Path = options.output or Path()
    check_output_folder(folder)
    check_json(options.json)

    from .reference_cache import ReferenceCache

    cache = ReferenceCache(options.cache)
    # Dr.Jit takes its libLLVM when it is first imported, which the modules below do.
    llvm.activate()
    from mlrt_plugin.errors import MlrtError

    from .machine import machine_of_comparison
    from .speed_error import Plan, measure
    from .speed_error_figures import figures_of
    from .speed_error_text import markdown, plot

    warnings.showwarning = show_warning
    plan = Plan(
        options.spp, options.rounds, options.reference_factor, options.least_seconds
    )
    machine = machine_of_comparison()
    try:
        measured = measure(settings, plan, cache)
    except MlrtError as error:
        raise CannotRun(str(error)) from error
    for warning in measured.warnings:
        print(f"{PROGRAM}: warning: {warning}", file=sys.stderr)
    figures = figures_of(measured, machine)
    text = markdown(figures)
    paths = write_all(folder, settings.scene.stem, figures, text, plot(figures, "png"))
    write_json(options.json, figures)
    print(text)
    print("wrote " + ", ".join(map(str, paths)))
    return PASSED if figures["passed"] else FAILED


def write_all(
    folder: Path, stem: str, figures: dict[str, Any], text: str, picture: bytes
) -> list[Path]:
    """Writes STEM-speed-error.json, .md and .png, all or none; returns their paths.

    Raises CannotRun if that is not possible.
    """
    try:
        folder.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".mlrt-compare-") as temporary:
            names = [f"{stem}-speed-error.{kind}" for kind in ("json", "md", "png")]
            unfinished = [Path(temporary) / name for name in names]
            write_json(unfinished[0], figures)
            unfinished[1].write_text(text)
            unfinished[2].write_bytes(picture)
            return [put_in_place(path, folder / path.name) for path in unfinished]
    except OSError as error:
        raise CannotRun(f"{folder} cannot be written to: {error.strerror}") from error


def sample_counts(text: str) -> tuple[int, ...]:
    convert = at_least(1, 2**20)
    return tuple(sorted({convert(part) for part in text.split(",")}))


def short_seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not 0 <= value <= 60:
        raise argparse.ArgumentTypeError(f"{text} is not from 0 to 60 seconds")
    return value


def speed_error_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=f"{PROGRAM} speed-error",
        description="Renders a scene with MLRT and with Mitsuba's llvm_ad_rgb over numbers "
        "of samples, in turns and with the same seeds, and tells time, error against a "
        "converged reference, efficiency, and the factors at equal time and at equal "
        "error. Cold starts are told apart.",
        epilog="Exit codes: 0 the factors may be called a speed-up; 2 they may not, as the "
        "estimators differ, the error does not fall as it must, or a bias shows; 4 could "
        "not run.",
    )
    add_scene_options(parser)
    parser.add_argument(
        "--spp",
        type=sample_counts,
        default=DEFAULT_SPP,
        metavar="N,M",
        help="samples a pixel (1,2,4,...,64)",
    )
    parser.add_argument(
        "--rounds",
        type=at_least(4),
        default=DEFAULT_ROUNDS,
        help="runs of each renderer and number of samples (%(default)s)",
    )
    parser.add_argument(
        "--reference-factor",
        type=at_least(1),
        default=REFERENCE_FACTOR,
        metavar="N",
        help="samples of the references over the most samples measured (%(default)s)",
    )
    parser.add_argument(
        "--least-seconds",
        type=short_seconds,
        default=LEAST_SECONDS,
        metavar="S",
        help="that a measurement of time lasts, of frames in a row if need be "
        "(%(default)s)",
    )
    parser.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        help="folder that references are kept in (~/.cache/mlrt-compare)",
    )
    add_output_options(parser, "figures, table and plot (.)")
    return parser
