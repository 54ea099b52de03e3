"""The source checkout: benchmarks compile it and use its scenes."""

from __future__ import annotations

from pathlib import Path

from .errors import BenchError

LANDMARKS = ("cpp/core.cmake", "compare/benchmarks/CMakeLists.txt")


def is_checkout(folder: Path) -> bool:
    return all((folder / name).is_file() for name in LANDMARKS)


def find_checkout(given: Path | None) -> Path:
    """``given``, or the folder around the current one that is a checkout of MLRT.

    Raises BenchError if there is none.
    """
    if given is not None:
        if not is_checkout(given):
            raise BenchError(
                f"{given} is not a source checkout of MLRT: it has no {LANDMARKS[1]}"
            )
        return given.resolve()
    here = Path.cwd()
    for folder in (here, *here.parents):
        if is_checkout(folder):
            return folder
    raise BenchError(
        "benchmarks are compiled from MLRT's sources, which are not in the current folder: "
        "run in a source checkout or name one with --source"
    )
