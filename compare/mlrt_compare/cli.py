"""The command mlrt-compare.

Exit codes: 0 the images agree, 2 they do not, 4 the comparison could not be made, 130
interrupted. With ``MLRT_DEBUG`` set in the environment, errors come with a traceback.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn

from . import llvm
from .settings import Settings
from .timing import DEFAULT_ROUNDS

PASSED, FAILED, COULD_NOT_RUN, INTERRUPTED = 0, 2, 4, 130
PROGRAM = "mlrt-compare"
SEED_LIMIT = 2**32  # seeds have 32 bits in Mitsuba


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code. ``argv`` is without the program's
    name."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = COMMANDS.get(arguments[0]) if arguments else None
    try:
        return compare_scene(arguments) if command is None else command(arguments[1:])
    except (llvm.LlvmUnavailable, CannotRun) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return COULD_NOT_RUN
    except KeyboardInterrupt:
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        message = " ".join(str(error).split())
        print(f"{PROGRAM}: {type(error).__name__}: {message}", file=sys.stderr)
        return COULD_NOT_RUN


class CannotRun(Exception):
    """The comparison cannot be made; the message is one sentence that says why."""


def compare_scene(arguments: Sequence[str]) -> int:
    """mlrt-compare SCENE: renders a scene on both sides and judges the images."""
    options = scene_parser().parse_args(arguments)
    settings = Settings(
        scene=options.scene,
        spp=options.spp,
        seed=options.seed,
        sensor=options.sensor,
        resolution=options.resolution,
        threads=options.threads,
        shading=options.shading,
        defines=dict(options.define),
    )
    check_output_folder(options.output)
    if options.json is not None and options.json.is_dir():
        raise CannotRun(f"the file {options.json} to write figures to is a folder")
    if options.json is not None and not options.json.absolute().parent.is_dir():
        raise CannotRun(
            f"there is no folder {options.json.parent} to write {options.json} to"
        )

    # Dr.Jit takes its libLLVM when it is first imported, which the modules below do.
    llvm.activate()
    try:
        from mlrt_plugin.errors import MlrtError
        from mlrt_plugin.parsing import resolving_from

        from .outputs import write_outputs
        from .report import summary
        from .run import compare
    except ModuleNotFoundError as error:
        raise CannotRun(
            f"the package {error.name} is missing: install what comparisons need with "
            "pip install 'mlrt[compare]'"
        ) from error

    warnings.showwarning = show_warning
    try:
        with resolving_from(*options.append):
            comparison = compare(settings, rounds=options.rounds)
        for warning in comparison.warnings:
            print(f"{PROGRAM}: warning: {warning}", file=sys.stderr)
        paths = write_outputs(comparison, options.output)
        figures = comparison.as_dict()
        if options.json is not None:
            options.json.write_text(json.dumps(figures, indent=2) + "\n")
    except (MlrtError, OSError) as error:
        raise CannotRun(str(error)) from error
    print(summary(figures))
    print("wrote " + ", ".join(map(str, paths)))
    return PASSED if comparison.verdict.passed else FAILED


COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {"scene": compare_scene}
"""What the first argument may be instead of a scene; "scene" itself is the default."""


class Parser(argparse.ArgumentParser):
    """Reports a wrong call in one sentence, with the exit code for what could not run."""

    def error(self, message: str) -> NoReturn:
        raise CannotRun(f"{message} (see {PROGRAM} --help)")


def scene_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=PROGRAM,
        description="Renders a Mitsuba scene with MLRT and with Mitsuba's llvm_ad_rgb: "
        "direct illumination, the same samples. Writes both images and their difference "
        "and tells whether they agree.",
        epilog="Exit codes: 0 the images agree, 2 they do not, 4 could not run.",
    )
    parser.add_argument("scene", type=Path, metavar="SCENE", help="Mitsuba 3 XML file")
    parser.add_argument("--spp", type=at_least(1), help="samples a pixel (the scene's)")
    parser.add_argument(
        "--resolution",
        type=resolution,
        metavar="WxH",
        help="size of the film (the scene's)",
    )
    parser.add_argument(
        "--seed", type=at_least(0, SEED_LIMIT), default=0, help="random seed (0)"
    )
    parser.add_argument(
        "-D",
        dest="define",
        type=definition,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="value of a $parameter of the scene",
    )
    parser.add_argument(
        "-s",
        dest="sensor",
        type=at_least(0),
        default=0,
        metavar="SENSOR",
        help="number of the sensor, from 0 (0)",
    )
    parser.add_argument(
        "-t",
        dest="threads",
        type=at_least(1),
        metavar="THREADS",
        help="of both sides (all)",
    )
    parser.add_argument(
        "-a",
        dest="append",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="folder in which files of the scene are looked for as well; may be repeated",
    )
    parser.add_argument(
        "--shading",
        choices=("auto", "native", "mitsuba"),
        help="who shades MLRT's image (the scene's option, else auto)",
    )
    parser.add_argument(
        "-o",
        dest="output",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="folder for the images, made if its parent exists (.)",
    )
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write all figures there"
    )
    parser.add_argument(
        "--rounds",
        type=at_least(1),
        default=DEFAULT_ROUNDS,
        help="timed rounds of the steady state, four frames each: A B B A (%(default)s)",
    )
    return parser


def at_least(minimum: int, limit: int = 2**31) -> Callable[[str], int]:
    """Reads a whole number from ``minimum`` to below ``limit``."""

    def convert(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
        if value < minimum:
            raise argparse.ArgumentTypeError(f"{value} is less than {minimum}")
        if value >= limit:
            raise argparse.ArgumentTypeError(f"{value} is not less than {limit}")
        return value

    return convert


def resolution(text: str) -> tuple[int, int]:
    width, cross, height = text.partition("x")
    if not (
        cross and width.isdecimal() and height.isdecimal() and int(width) * int(height)
    ):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not of the form WIDTHxHEIGHT, like 640x480"
        )
    return int(width), int(height)


def definition(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not (key and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form KEY=VALUE")
    return key, value


def check_output_folder(folder: Path) -> None:
    """Raises CannotRun unless ``folder`` is there or can be made."""
    if folder.exists() and not folder.is_dir():
        raise CannotRun(f"the output {folder} is not a folder")
    if not folder.exists() and not folder.absolute().parent.is_dir():
        raise CannotRun(
            f"the output folder {folder} cannot be made: there is no folder "
            f"{folder.absolute().parent}"
        )


def show_warning(message: Warning | str, *_: object, **__: object) -> None:
    print(f"{PROGRAM}: warning: {message}", file=sys.stderr)
