"""The command mlrt-compare.

Exit codes: 0 the images agree, 1 they agree with a warning, 2 they do not, 4 the comparison
could not be made, 130 interrupted. With ``MLRT_DEBUG`` set in the environment, errors come
with a traceback.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence

from . import llvm
from .options import COULD_NOT_RUN, INTERRUPTED, PROGRAM, CannotRun


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code. ``argv`` is without the program's
    name."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = COMMANDS.get(arguments[0]) if arguments else None
    try:
        return compare_scene(arguments) if command is None else command(arguments[1:])
    except ModuleNotFoundError as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        print(
            f"{PROGRAM}: the package {error.name} is missing: install what comparisons "
            "need with pip install 'mlrt[compare]'",
            file=sys.stderr,
        )
        return COULD_NOT_RUN
    except (llvm.LlvmUnavailable, CannotRun) as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return COULD_NOT_RUN
    except KeyboardInterrupt:
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except OSError as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        named = error.filename is not None and error.strerror is not None
        message = f"{error.filename}: {error.strerror}" if named else str(error)
        print(f"{PROGRAM}: {message}", file=sys.stderr)
        return COULD_NOT_RUN
    except Exception as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        message = " ".join(str(error).split())
        print(f"{PROGRAM}: {type(error).__name__}: {message}", file=sys.stderr)
        return COULD_NOT_RUN


# What the commands need is imported late: a wrong call is answered without loading Mitsuba.


def compare_scene(arguments: Sequence[str]) -> int:
    from .scene_command import run

    return run(arguments)


def compare_images(arguments: Sequence[str]) -> int:
    from .image_command import run

    return run(arguments)


def judge_pixels(arguments: Sequence[str]) -> int:
    from .ztest_command import run

    return run(arguments)


def judge_parity(arguments: Sequence[str]) -> int:
    from .parity_command import run

    return run(arguments)


def speed_and_error(arguments: Sequence[str]) -> int:
    from .speed_error_command import run

    return run(arguments)


def sweep_scenes(arguments: Sequence[str]) -> int:
    from .sweep_command import run

    return run(arguments)


def repeat_the_paper(arguments: Sequence[str]) -> int:
    from .paper_command import run

    return run(arguments)


COMMANDS: dict[str, Callable[[Sequence[str]], int]] = {
    "scene": compare_scene,
    "image": compare_images,
    "ztest": judge_pixels,
    "parity": judge_parity,
    "speed-error": speed_and_error,
    "sweep": sweep_scenes,
    "paper": repeat_the_paper,
}
"""What the first argument may be instead of a scene; "scene" itself is the default."""
