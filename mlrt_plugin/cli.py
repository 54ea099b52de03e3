"""The command ``mlrt``: renders scenes, or tells of the tree of one or what it uses.

Exit codes: 0 done, 1 the scene or the output is at fault, 2 the command line is, 130
interrupted. With ``MLRT_DEBUG`` set in the environment, errors come with a traceback.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NoReturn

import mitsuba as mi

from . import __version__
from .info import scene_report
from .parsing import resolving_from
from .render_command import (
    add_render_options,
    add_shading,
    complaint,
    file_path,
    run_render,
)
from .tree_command import add_build_options, add_tree_cache, run_tree

EXIT_ERROR, EXIT_USAGE, EXIT_INTERRUPTED = 1, 2, 130

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


def folders(text: str) -> list[Path]:
    paths = [Path(part) for part in text.split(";") if part]
    for path in paths:
        if not path.is_dir():
            raise argparse.ArgumentTypeError(f"'{path}' is no folder")
    return paths


def make_parser() -> argparse.ArgumentParser:
    parser = Parser(prog="mlrt", description="Multi-level ray tracing of Mitsuba 3 scenes.")
    parser.add_argument("--version", action="version", version=f"mlrt {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, parser_class=Parser)
    common = Parser(add_help=False)
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
        "-a",
        "--append",
        type=folders,
        default=[],
        metavar="DIR[;DIR]...",
        help="folders in which files of the scene are looked for as well",
    )
    common.add_argument("-v", "--verbose", action="store_true", help="tell more")
    one_scene = Parser(add_help=False)
    one_scene.add_argument(
        "scene", type=file_path, metavar="SCENE", help="a Mitsuba XML file"
    )
    one_scene.add_argument(
        "-s", "--sensor", type=int, default=0, help="number of the sensor, from 0"
    )
    add_render_options(
        commands.add_parser(
            "render", parents=[common], help="render one scene, or several after another"
        )
    )
    tree = commands.add_parser(
        "tree",
        parents=[one_scene, common],
        help="build the tree of a scene and tell what it is like",
    )
    tree.add_argument("-t", "--threads", type=int, help="threads (default: all)")
    tree.add_argument("--json", action="store_true", help="print one JSON object")
    add_tree_cache(tree)
    add_build_options(tree)
    add_shading(
        commands.add_parser(
            "info", parents=[one_scene, common], help="tell what a scene uses"
        )
    )
    return parser


def run_info(arguments: argparse.Namespace) -> None:
    lines = scene_report(
        arguments.scene,
        sensor=arguments.sensor,
        defines=dict(arguments.define),
        shading=arguments.shading,
    )
    print("\n".join(lines))


COMMANDS = {"render": run_render, "tree": run_tree, "info": run_info}


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command with the given arguments, or those of the process."""
    arguments = make_parser().parse_args(argv)
    level = mitsuba.log_level()
    mitsuba.set_log_level(mi.LogLevel.Info if arguments.verbose else mi.LogLevel.Error)
    try:
        with resolving_from(*arguments.append):
            COMMANDS[arguments.command](arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("mlrt: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        # Whoever read the output has enough; nor may Python try once more when it ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_ERROR
    except (MemoryError, Exception) as error:
        print(f"mlrt: error: {complaint(error)}", file=sys.stderr)
        return EXIT_ERROR
    finally:
        mitsuba.set_log_level(level)
    return 0
