"""mlrt-compare SCENE: renders a scene on both sides and judges the images."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
from .timing import DEFAULT_ROUNDS


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code. Raises CannotRun."""
    options = scene_parser().parse_args(arguments)
    settings = settings_of(options, options.scene, options.spp)
    folder: Path = options.output or Path()
    check_output_folder(folder)
    check_json(options.json)
    measured = speed_error_of(options, folder)

    # Dr.Jit takes its libLLVM when it is first imported, which the modules below do.
    llvm.activate()
    from mlrt_plugin.errors import MlrtError

    from .outputs import write_outputs
    from .report import summary
    from .run import compare

    warnings.showwarning = show_warning
    try:
        comparison = compare(settings, rounds=options.rounds, cost=options.report)
        for warning in comparison.warnings:
            print(f"{PROGRAM}: warning: {warning}", file=sys.stderr)
        page = None
        if options.report and comparison.verdict.difference is not None:
            from .machine import machine_of_comparison
            from .report_page import report_page

            page = report_page(comparison, machine_of_comparison(), measured)
        elif options.report:
            show_warning("there is no report, as the images differ in size")
        paths = write_outputs(comparison, folder, page)
        figures = comparison.as_dict()
        write_json(options.json, figures)
    except MlrtError as error:
        raise CannotRun(str(error)) from error
    print(summary(figures))
    print("wrote " + ", ".join(map(str, paths)))
    return PASSED if comparison.verdict.passed else FAILED


def scene_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=PROGRAM,
        description="Renders a Mitsuba scene with MLRT and with Mitsuba's llvm_ad_rgb: "
        "direct illumination, the same samples. Writes both images and their difference "
        "and tells whether they agree.",
        epilog="Exit codes: 0 the images agree, 2 they do not, 4 could not run. Other "
        "commands, each with its own --help: image, which compares EXR files; ztest, which "
        "tests renders as Mitsuba tests its own; parity, which sets rays apart that hit "
        "different things; speed-error, which measures error over time; sweep, which "
        "compares many scenes; paper, which repeats the tables of the MLRTA paper.",
    )
    add_scene_options(parser)
    parser.add_argument("--spp", type=at_least(1), help="samples a pixel (the scene's)")
    add_output_options(parser, "the images (.)")
    parser.add_argument(
        "--report",
        action="store_true",
        help="also write a page to look at: images, error and cost maps, timings",
    )
    parser.add_argument(
        "--speed-error",
        type=Path,
        metavar="JSON",
        help="figures of speed-error that the report plots (those in the folder)",
    )
    parser.add_argument(
        "--rounds",
        type=at_least(1),
        default=DEFAULT_ROUNDS,
        help="timed rounds of the steady state, four frames each: A B B A (%(default)s)",
    )
    return parser


def speed_error_of(options: argparse.Namespace, folder: Path) -> dict[str, Any] | None:
    """The figures of `mlrt-compare speed-error` for the report: of the file that is named,
    or of the one that it wrote into the same folder, if there is one.

    Raises CannotRun for a file that holds none.
    """
    path: Path = options.speed_error or folder / f"{options.scene.stem}-speed-error.json"
    if options.speed_error is None and not (options.report and path.is_file()):
        return None
    if not options.report:
        raise CannotRun("--speed-error is for the report: give --report as well")
    try:
        figures: dict[str, Any] = json.loads(path.read_text())
        if not {"sides", "equal_time", "equal_error", "machine"} <= figures.keys():
            raise ValueError("it has no curves")
    except (OSError, ValueError, AttributeError) as error:
        raise CannotRun(
            f"{path} holds no figures of {PROGRAM} speed-error ({error}): measure them anew"
        ) from error
    return figures


def show_warning(message: Warning | str, *_: object, **__: object) -> None:
    print(f"{PROGRAM}: warning: {message}", file=sys.stderr)
