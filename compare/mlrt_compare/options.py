"""Options that the commands of mlrt-compare share, and what is refused."""

from __future__ import annotations

import argparse
import json
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from mlrt_files import is_special, obstacle, replacing

from .settings import Settings

PASSED, WARNED, FAILED, COULD_NOT_RUN, INTERRUPTED = 0, 1, 2, 4, 130
"""Exit codes; the first four are those of OpenImageIO's idiff."""
PROGRAM = "mlrt-compare"
SEED_LIMIT = 2**32  # seeds have 32 bits in Mitsuba


class CannotRun(Exception):
    """The comparison cannot be made; the message is one sentence that says why."""


class Parser(argparse.ArgumentParser):
    """Reports a wrong call in one sentence, with the exit code for what could not run."""

    def error(self, message: str) -> NoReturn:
        raise CannotRun(f"{message} (see {self.prog} --help)")


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """The scene, and what of it is rendered."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="Mitsuba 3 XML file")
    add_scene_choices(parser)


def add_scene_choices(parser: argparse.ArgumentParser) -> None:
    """What of a scene is rendered, with the letters of Mitsuba's own command."""
    parser.add_argument(
        "--resolution",
        type=resolution,
        metavar="WxH",
        help="size of the film (the scene's)",
    )
    parser.add_argument(
        "--seed", type=at_least(0, SEED_LIMIT), default=0, help="random seed (0)"
    )
    add_choices_of_all(parser)


def add_choices_of_all(parser: argparse.ArgumentParser) -> None:
    """Those of `add_scene_choices` of which there is one for all images of a command."""
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
        type=existing_folder,
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


def settings_of(options: argparse.Namespace, scene: Path, spp: int | None) -> Settings:
    """What the options of `add_scene_choices` ask for."""
    return settings_with(options, scene, spp, options.seed, options.resolution)


def settings_with(
    options: argparse.Namespace,
    scene: Path,
    spp: int | None,
    seed: int,
    resolution: tuple[int, int] | None,
) -> Settings:
    """What the options of `add_choices_of_all` ask for, with the rest given."""
    return Settings(
        scene=scene,
        spp=spp,
        seed=seed,
        sensor=options.sensor,
        resolution=resolution,
        threads=options.threads,
        shading=options.shading,
        folders=tuple(options.append),
        defines=dict(options.define),
    )


def add_output_options(parser: argparse.ArgumentParser, what: str) -> None:
    parser.add_argument(
        "-o",
        dest="output",
        type=Path,
        metavar="DIR",
        help=f"folder for {what}, made if its parent exists",
    )
    add_json(parser)


def add_json(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="also write all figures there"
    )


def add_table(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--table", type=Path, metavar="FILE", help="write a table in Markdown there"
    )


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


def number(text: str) -> float:
    """Reads a number that is not nan; infinity is one."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if math.isnan(value):
        raise argparse.ArgumentTypeError("nan is not a number")
    return value


def percentage(text: str) -> float:
    value = number(text)
    if not 0 <= value <= 100:
        raise argparse.ArgumentTypeError(f"{text} is not from 0 to 100")
    return value


def existing_folder(text: str) -> Path:
    path = Path(text)
    if not path.is_dir():
        raise argparse.ArgumentTypeError(f"there is no folder {text!r}")
    return path


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
    check_permission(folder if folder.exists() else folder.absolute().parent)


def check_json(path: Path | None) -> None:
    """Raises CannotRun for a file that could not be written after all the work."""
    if path is not None and (found := obstacle(path)):
        raise CannotRun(f"{path} cannot be written: {found}")


def check_permission(folder: Path) -> None:
    """Raises CannotRun for a folder that files cannot be made in."""
    if not os.access(folder, os.W_OK | os.X_OK):
        raise CannotRun(
            f"there is no permission to write to the folder {folder}: name another"
        )


def write_json(path: Path | None, figures: Any, *, more_to_come: bool = False) -> None:
    """Writes figures, all of them or no file; a number that is not finite becomes null.

    more_to_come: as `write_text` has it. Raises CannotRun if that is not possible.
    """
    if path is not None:
        text = json.dumps(without_nonfinite(figures), indent=2, allow_nan=False)
        write_text(path, text + "\n", more_to_come=more_to_come)


def write_text(path: Path | None, text: str, *, more_to_come: bool = False) -> None:
    """Writes a text, all of it or no file.

    more_to_come: that a longer one will take its place. A pipe, where that is not possible,
    gets the last one only. Raises CannotRun if a text cannot be written.
    """
    if path is None:
        return
    try:
        if more_to_come and is_special(path):
            return
        with replacing(path) as temporary:
            temporary.write_text(text)
    except OSError as error:
        raise CannotRun(f"{path} cannot be written: {error.strerror}") from error


def without_nonfinite(figures: Any) -> Any:
    """The same, with None for each number that JSON does not have."""
    if isinstance(figures, dict):
        return {key: without_nonfinite(value) for key, value in figures.items()}
    if isinstance(figures, list | tuple):
        return [without_nonfinite(value) for value in figures]
    if isinstance(figures, float) and not math.isfinite(figures):
        return None
    return figures
