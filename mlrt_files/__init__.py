"""Writes files whole or not at all, and tells before the work what will keep it from that.

A symbolic link is written through. What there is and is no regular file, such as a device,
a pipe or ``/dev/stdout``, gets what is written and stays what it is. Commands of
``mlrt_compare`` look before they load drjit or mitsuba, so this package, which is none of
``mlrt_plugin``, imports neither.
"""

from __future__ import annotations

import fcntl
import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

OWN_DESCRIPTORS = "/proc/self/fd"
MOST_LINKS = 40
"""That Linux follows one after another."""
MOST_OF_STEM = 48
"""Characters of a name in that of its temporary file, which has at most 255 bytes."""


def obstacle(path: Path) -> str | None:
    """Tells, in a clause, what keeps a file from being written; None if nothing is seen.

    Nothing is opened or made for that: the reader of a pipe would take it for the end.
    """
    try:
        number = own_descriptor(path)
        if number is not None:
            flags = fcntl.fcntl(number, fcntl.F_GETFL)
            return "it is open to be read" if flags & os.O_ACCMODE == os.O_RDONLY else None
        mode = mode_of(path)
    except OSError as error:
        return error.strerror or str(error)
    folder = Path(os.path.realpath(path)).parent
    if mode is not None and stat.S_ISDIR(mode):
        return "it is a folder: name a file"
    if mode is not None and not stat.S_ISREG(mode):
        return None if os.access(path, os.W_OK) else "there is no permission to write to it"
    if not folder.is_dir():
        # As it was named, unless that is a link to somewhere else.
        named = folder if path.is_symlink() else path.parent
        return f"there is no folder {named}: create it first"
    if not os.access(folder, os.W_OK | os.X_OK):
        return f"there is no permission to write to the folder {folder}: name another"
    return None


def is_special(path: Path) -> bool:
    """Whether there is something that is neither a regular file nor a folder, or that only
    this process knows by that name."""
    if own_descriptor(path) is not None:
        return True
    mode = mode_of(path)
    return mode is not None and not stat.S_ISREG(mode) and not stat.S_ISDIR(mode)


@contextmanager
def replacing(path: Path, suffix: str | None = None) -> Iterator[Path]:
    """The name of a temporary file, to be written, with the suffix of ``path`` unless told
    otherwise, as for folders that others look for such files in. In the end it takes the
    place of ``path``, or is poured into what is special there; if anything fails before, it
    goes. Raises OSError.

    Others see the old file or the new one, however many write at once.
    """
    suffix = path.suffix if suffix is None else suffix
    if is_special(path):
        with tempfile.TemporaryDirectory(prefix="mlrt-") as folder:
            temporary = Path(folder) / f"output{suffix}"
            yield temporary
            with temporary.open("rb") as source, opened(path) as destination:
                shutil.copyfileobj(source, destination)
        return
    target = Path(os.path.realpath(path))
    name = f".{target.stem[:MOST_OF_STEM]}.{secrets.token_hex(8)}{suffix}"
    temporary = target.parent / name
    try:
        yield temporary
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)


def put_in_place(file: Path, path: Path) -> Path:
    """Moves a finished file to ``path``, as `replacing` does; returns ``path``."""
    with replacing(path) as temporary:
        shutil.move(file, temporary)
    return path


def opened(path: Path) -> BinaryIO:
    """What is special, to be written. A pipe waits for its reader."""
    number = own_descriptor(path)
    if number is None:
        return os.fdopen(os.open(path, os.O_WRONLY), "wb")
    # After what was printed, and not from the beginning of the file that it may be.
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    return os.fdopen(os.dup(number), "wb")


def own_descriptor(path: Path) -> int | None:
    """The N of /proc/self/fd/N and of names that lead there, like /dev/stdout; otherwise
    None."""
    folder = os.path.realpath(OWN_DESCRIPTORS)
    for _ in range(MOST_LINKS):
        if path.name.isdecimal() and os.path.realpath(path.parent) == folder:
            return int(path.name)
        if not path.is_symlink():
            break
        path = path.parent / path.readlink()
    return None


def mode_of(path: Path) -> int | None:
    """Of what the path leads to; None if there is nothing."""
    try:
        return path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        return None
