"""The command ``mlrt``: renders a scene, or tells of its tree or what it uses.

Exit codes: 0 done, 1 the scene or the output is at fault, 2 the command line is, 130
interrupted. With ``MLRT_DEBUG`` set in the environment, errors come with a traceback.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import mitsuba as mi

from . import __version__
from .errors import one_sentence
from .image_files import check_output, write_image
from .info import scene_report
from .options import AOVS, SHADOW_OFFSETS
from .progress import ProgressBar
from .render import checked_seed, checked_spp, prepare
from .threads import thread_count
from .tree_command import add_build_options, add_tree_cache, build_options_of, run_tree

EXIT_ERROR, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130
NO_MEMORY = (
    "there is not enough memory for the scene: close other programs, raise the limit that "
    "'ulimit -v' shows, or take a smaller scene"
)

mitsuba: Any = mi
"""For what Mitsuba's type stubs leave out."""


class Parser(argparse.ArgumentParser):
    """Reports a bad command line in one line."""

    def error(self, message: str) -> NoReturn:
        print(f"mlrt: error: {message}; see '{self.prog} --help'", file=sys.stderr)
        raise SystemExit(EXIT_USAGE)


def definition(text: str) -> tuple[str, str]:
    key, equals, value = text.partition("=")
    if not equals or not key.isidentifier():
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form key=value")
    return key, value


def resolution(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text)
    if not match or "0" in (match[1].lstrip("0") or "0", match[2].lstrip("0") or "0"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 640x480")
    return int(match[1]), int(match[2])


def aov_names(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in AOVS:
            raise argparse.ArgumentTypeError(
                f"'{name}' does not exist, choose from {', '.join(AOVS)}"
            )
    return names


def make_parser() -> argparse.ArgumentParser:
    parser = Parser(prog="mlrt", description="Multi-level ray tracing of Mitsuba 3 scenes.")
    parser.add_argument("--version", action="version", version=f"mlrt {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, parser_class=Parser)
    common = Parser(add_help=False)
    common.add_argument("scene", type=Path, metavar="SCENE", help="a Mitsuba XML file")
    common.add_argument(
        "-D",
        "--define",
        type=definition,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="value of $KEY in the scene; may be repeated",
    )
    common.add_argument(
        "-s", "--sensor", type=int, default=0, help="number of the sensor, from 0"
    )
    common.add_argument("-v", "--verbose", action="store_true", help="tell more")
    render = commands.add_parser("render", parents=[common], help="render a scene")
    render.add_argument(
        "-o",
        "--output",
        type=Path,
        help="image to write, .exr or .png (default: beside the scene, .exr)",
    )
    render.add_argument("-t", "--threads", type=int, help="threads (default: all)")
    render.add_argument("--spp", type=int, help="samples per pixel (default: the scene's)")
    render.add_argument("--seed", type=int, default=0, help="of the random numbers")
    render.add_argument("--resolution", type=resolution, metavar="WxH", help="in pixels")
    render.add_argument(
        "--aov",
        type=aov_names,
        default=(),
        metavar="NAMES",
        help=f"further channels, separated by commas: {', '.join(AOVS)}",
    )
    render.add_argument(
        "--shadow-offset",
        choices=SHADOW_OFFSETS,
        help="how shadow rays are kept off surfaces: by Mitsuba's formula, or by a bound "
        "of the error, for scenes of any size (default: the scene's, else mitsuba)",
    )
    add_tree_cache(render)
    add_build_options(render, ["builder"])
    tree = commands.add_parser(
        "tree", parents=[common], help="build the tree of a scene and tell what it is like"
    )
    tree.add_argument("-t", "--threads", type=int, help="threads (default: all)")
    tree.add_argument("--json", action="store_true", help="print one JSON object")
    add_tree_cache(tree)
    add_build_options(tree)
    commands.add_parser("info", parents=[common], help="tell what a scene uses")
    return parser


def run_render(arguments: argparse.Namespace) -> None:
    output = arguments.output or arguments.scene.with_suffix(".exr")
    check_output(output, arguments.aov)
    if arguments.spp is not None:
        checked_spp(arguments.spp)
    checked_seed(arguments.seed, 0)
    with thread_count(arguments.threads):
        prepared = prepare(
            arguments.scene,
            sensor=arguments.sensor,
            defines=dict(arguments.define),
            resolution=arguments.resolution,
            tree_cache=arguments.tree_cache,
            **build_options_of(arguments),
        )
        for message in prepared.warnings:
            print(f"mlrt: warning: {message}", file=sys.stderr)
        with ProgressBar("rendering") as progress:
            result = prepared.render(
                spp=arguments.spp,
                seed=arguments.seed,
                aovs=arguments.aov,
                shadow_offset=arguments.shadow_offset,
                progress=progress,
            )
    write_image(output, result.image, result.aovs)
    height, width = result.image.shape[:2]
    seconds = ", ".join(f"{name} {value:.3f} s" for name, value in result.timings.items())
    spp = arguments.spp or prepared.arrays.spp
    print(f"{output}: {width}x{height}, {spp} spp; {seconds}")
    if arguments.verbose:
        for name, value in {**prepared.report, **result.counters}.items():
            print(f"  {name}: {value}")


def run_info(arguments: argparse.Namespace) -> None:
    lines = scene_report(
        arguments.scene, sensor=arguments.sensor, defines=dict(arguments.define)
    )
    print("\n".join(lines))


COMMANDS = {"render": run_render, "tree": run_tree, "info": run_info}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command with the given arguments, or those of the process."""
    arguments = make_parser().parse_args(argv)
    level = mitsuba.log_level()
    mitsuba.set_log_level(mi.LogLevel.Info if arguments.verbose else mi.LogLevel.Error)
    try:
        COMMANDS[arguments.command](arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("mlrt: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except MemoryError:
        if os.environ.get("MLRT_DEBUG"):
            raise
        print(f"mlrt: error: {NO_MEMORY}", file=sys.stderr)
        return EXIT_ERROR
    except BrokenPipeError:
        # Whoever read the output has enough; nor may Python try once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_ERROR
    except Exception as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        message = one_sentence(str(error))
        if not isinstance(error, ValueError):
            message = f"{type(error).__name__}: {message}"
        print(f"mlrt: error: {message}", file=sys.stderr)
        return EXIT_ERROR
    finally:
        mitsuba.set_log_level(level)
    return 0
