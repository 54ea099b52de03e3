"""Options that the commands of mlrt-bench share, and what is refused."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from mlrt_files import obstacle

from .errors import BenchError

PLOTS = (".png", ".svg", ".pdf")
"""Kinds of images that plots are written as."""


def path(text: str) -> Path:
    """Of an option; nothing names no file, though Path takes it for the current folder."""
    if not text:
        raise argparse.ArgumentTypeError("an empty name is given: name a file or a folder")
    return Path(text)


class Parser(argparse.ArgumentParser):
    """Reports a wrong call in one sentence, with the exit code for what could not run."""

    def error(self, message: str) -> NoReturn:
        raise BenchError(f"{message} (see {self.prog} --help)")


def add_shared_options(
    command: argparse.ArgumentParser, *, repeats: int, scenes: str = "all usual ones"
) -> None:
    """Those that every command has. ``repeats``, ``scenes``: the usual ones."""
    add_json_option(command)
    command.add_argument(
        "--scenes",
        type=names,
        metavar="A,B",
        help=f"names of usual scenes or XML files ({scenes})",
    )
    command.add_argument(
        "--threads",
        type=counts,
        default=(1, 2),
        metavar="N,M",
        help="numbers of them (1,2)",
    )
    command.add_argument(
        "--repeats",
        type=count,
        default=repeats,
        metavar="N",
        help="runs of each (%(default)s)",
    )
    command.add_argument(
        "--resolution",
        type=count,
        default=1024,
        metavar="N",
        help="pixels along both sides of the frame (%(default)s)",
    )
    command.add_argument(
        "--cache",
        type=path,
        metavar="DIR",
        help="folder for generated scenes and the native side (~/.cache/mlrt-bench)",
    )
    add_source_option(command)


def add_study_options(command: argparse.ArgumentParser, *, rays: int) -> None:
    """Those of studies of hits. ``rays``: the usual number of them."""
    add_json_option(command)
    command.add_argument(
        "--rays",
        type=ray_count,
        default=rays,
        metavar="N",
        help=f"in all, such as 1e6 ({rays:.0e})",
    )
    command.add_argument(
        "--seed", type=count, default=1, metavar="N", help="of the random numbers (1)"
    )
    command.add_argument(
        "--threads", type=count, default=os.cpu_count() or 1, metavar="N", help="(all)"
    )
    command.add_argument(
        "--cache", type=path, metavar="DIR", help="folder for the native side"
    )
    add_source_option(command)


def add_json_option(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--json", type=path, metavar="FILE", help="write all figures there"
    )


def add_source_option(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--source",
        type=path,
        metavar="DIR",
        help="MLRT's source checkout (the current one)",
    )


def add_sample_counts(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--spp",
        type=sample_counts,
        default=(1, 16),
        metavar="N,M",
        help="samples a pixel, 1 or 16 (1,16)",
    )


def check_json(path: Path | None) -> None:
    """Raises BenchError for a file that could not be written after all the work."""
    if path is not None and (found := obstacle(path)):
        raise BenchError(f"{path} cannot be written: {found}")


def check_cache(path: Path | None) -> None:
    """Makes the folder; raises BenchError if what is compiled cannot be kept there."""
    if path is None:
        return
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BenchError(
            f"the folder {path} for --cache cannot be made ({error.strerror}): name another"
        ) from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise BenchError(f"there is no permission to write to --cache {path}: name another")


def check_folder_of(path: Path) -> None:
    folder = path.absolute().parent
    if not folder.is_dir():
        raise BenchError(f"there is no folder {path.parent} to write {path} to")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BenchError(f"there is no permission to write {path}: name another folder")


def check_images(folder: Path | None) -> None:
    """Raises BenchError for a folder that could not be made or written to."""
    if folder is None:
        return
    check_folder_of(folder)
    if folder.is_file():
        raise BenchError(f"{folder} to write images to is not a folder")


def check_plot(path: Path) -> None:
    """Raises BenchError for a file that a plot could not be written to after the work."""
    if path.suffix not in PLOTS:
        raise BenchError(f"the plot {path} must be one of {', '.join(PLOTS)}")
    check_folder_of(path)


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


def ray_count(text: str) -> int:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not (1 <= value <= 1e12 and value.is_integer()):
        raise argparse.ArgumentTypeError(f"{text} is not a whole number from 1 to 1e12")
    return int(value)


def counts(text: str) -> tuple[int, ...]:
    return tuple(dict.fromkeys(count(part) for part in text.split(",")))


def sizes(text: str) -> tuple[int, ...]:
    """Powers of two from 4 to 1024."""
    found = counts(text)
    for size in found:
        if not 4 <= size <= 1024 or size & (size - 1):
            raise argparse.ArgumentTypeError(f"{size} is not a power of two from 4 to 1024")
    return found


def sample_counts(text: str) -> tuple[int, ...]:
    found = counts(text)
    for value in found:
        if value not in (1, 16):
            raise argparse.ArgumentTypeError(f"{value} samples a pixel: choose 1 or 16")
    return found


def settings_of_tracing(text: str) -> dict[str, int | bool | str]:
    """Options of the tracer: numbers, `true` and `false`, and names."""
    settings: dict[str, int | bool | str] = {}
    for part in text.split(","):
        key, equals, value = part.partition("=")
        if not (key and equals and value):
            raise argparse.ArgumentTypeError(f"{part!r} is not of the form KEY=VALUE")
        if value in ("true", "false"):
            settings[key] = value == "true"
        else:
            settings[key] = int(value) if value.isdecimal() else value
    return settings
