"""Defects of OBJ files that Mitsuba does not see, or reports in words that do not help."""

from __future__ import annotations

import mmap
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

LONGEST_LINE = 4096
"""Bytes at the end of a file in which its last line must begin; Mitsuba's own limit."""
FACE = re.compile(rb"^[ \t]*f[ \t]", re.MULTILINE)
NUMBERS = {b"v": 3, b"vn": 3, b"vt": 2, b"f": 3}
"""The least that has to follow a keyword."""


def defect(path: Path) -> str:
    """What is wrong with a file, to be read after its name; empty if nothing is.

    A file may end without a line break. Its last line is then taken to be cut off if it
    lacks numbers, or if the last corner of a face has fewer than the first: Mitsuba drops a
    face of two corners in silence. Raises OSError or ValueError if the file cannot be read
    or is empty.
    """
    with (
        path.open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content,
    ):
        if not FACE.search(content):
            return "has no faces: it is truncated, or no OBJ file"
        end = content[-LONGEST_LINE:]
    *_, last = end.rsplit(b"\n", 1)
    keyword, *values = last.split() or [b""]
    short = len(values) < NUMBERS.get(keyword, 0)
    if keyword == b"f" and not short:
        short = corner_form(values[-1]) != corner_form(values[0])
    if short:
        line = last.decode("ascii", "replace").strip()
        return f"ends within its last line '{line}': it is truncated, export it anew"
    return ""


def corner_form(corner: bytes) -> tuple[bool, ...]:
    """Which of the numbers of a corner such as ``1//3`` are there."""
    return tuple(bool(number) for number in corner.split(b"/"))


def positions(path: Path) -> npt.NDArray[np.float64]:
    """(V, 3) coordinates of the vertices; raises ValueError if one is no number."""
    lines = path.read_bytes().splitlines()
    rows = [
        line.split()[1:4] for line in lines if line.lstrip().startswith((b"v ", b"v\t"))
    ]
    return np.array(rows).astype(np.float64).reshape(-1, 3)
