"""Errors and warnings of the package; each message is one sentence."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable


class MlrtError(ValueError):
    """Something that the caller gave cannot be used."""


class SceneError(MlrtError):
    """A scene, or a file that belongs to it, is missing, malformed or makes no sense."""


class UnsupportedFeature(SceneError):
    """The scene uses a plugin or a parameter that cannot be rendered natively."""


class OutputError(MlrtError):
    """An image cannot be written where it is wanted."""


class TreeFileError(MlrtError):
    """A file does not hold the tree that is wanted, or a tree cannot be written to it."""


class MlrtWarning(UserWarning):
    """Something in the scene is approximated or ignored; the message names it."""


def warn_of(messages: Iterable[str], stacklevel: int) -> None:
    """Warns of each; 1 makes the caller of this function the place, 2 its caller."""
    for message in messages:
        warnings.warn(message, MlrtWarning, stacklevel=stacklevel + 1)


def one_sentence(message: str) -> str:
    """Mitsuba's report of an exception as a single line.

    Drops what only its developers need (source locations, classes, terminal colours, what
    objects hold), and says once what nested files repeat.
    """
    message = without_contents(message)
    message = re.sub(r"\x1b\[[0-9;]*m", "", message)
    message = re.sub(r"\[[\w.]+\.(?:cpp|h):\d+\]\s*", "", message)
    message = re.sub(r"\[[A-Z]\w+\] ", "", message)
    message = re.sub(
        r'failed to instantiate (\w+) plugin of type "(\w+)": ', r"\1 '\2': ", message
    )
    message = " ".join(message.split())
    message = re.sub(r"(.{10,}?: )\1+", r"\1", message)
    return message.rstrip("!. ")


def without_contents(message: str) -> str:
    """Leaves the name of descriptions of objects, which go over lines as `Name[`, ...,
    `]`."""
    result = ""
    while begin := re.search(r"\b[A-Z]\w*(?=\[\n)", message):
        result += message[: begin.end()]
        depth, position = 1, begin.end() + 1
        while depth and position < len(message):
            depth += {"[": 1, "]": -1}.get(message[position], 0)
            position += 1
        message = message[position:]
    return result + message
