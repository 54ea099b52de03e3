"""mlrt-compare SCENE: renders a scene on both sides and judges the images."""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

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
    write_json,
)
from .settings import Settings
from .timing import DEFAULT_ROUNDS


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code. Raises CannotRun."""
    options = scene_parser().parse_args(arguments)
    settings = Settings(
        scene=options.scene,
        spp=options.spp,
        seed=options.seed,
        sensor=options.sensor,
        resolution=options.resolution,
        threads=options.threads,
        defines=dict(options.define),
    )
    folder: Path = options.output or Path()
    check_output_folder(folder)
    check_json(options.json)

    # Dr.Jit takes its libLLVM when it is first imported, which the modules below do.
    llvm.activate()
    from mlrt_plugin.errors import MlrtError

    from .outputs import write_outputs
    from .report import summary
    from .run import compare

    warnings.showwarning = show_warning
    try:
        comparison = compare(settings, rounds=options.rounds)
        for warning in comparison.warnings:
            print(f"{PROGRAM}: warning: {warning}", file=sys.stderr)
        paths = write_outputs(comparison, folder)
        figures = comparison.as_dict()
        write_json(options.json, figures)
    except (MlrtError, OSError) as error:
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
        "tests renders as Mitsuba tests its own; speed-error, which measures error over "
        "time.",
    )
    add_scene_options(parser)
    parser.add_argument("--spp", type=at_least(1), help="samples a pixel (the scene's)")
    add_output_options(parser, "the images (.)")
    parser.add_argument(
        "--rounds",
        type=at_least(1),
        default=DEFAULT_ROUNDS,
        help="timed rounds of the steady state, four frames each: A B B A (%(default)s)",
    )
    return parser


def show_warning(message: Warning | str, *_: object, **__: object) -> None:
    print(f"{PROGRAM}: warning: {message}", file=sys.stderr)
