"""A check of image files that Mitsuba does not make: it crashes on images without pixels in
the formats that say in plain text how large they are."""

from __future__ import annotations

import re
from pathlib import Path

from .errors import SceneError

HEADER = 4096
"""Bytes of a file that are looked at."""
PORTABLE = re.compile(rb"P[2356Ff]\s(?:\s|#[^\n]*\n)*(\d+)(?:\s|#[^\n]*\n)+(\d+)\s")
"""Of PPM, PGM and PFM files (the man pages of Netpbm): a comment may stand between."""
RADIANCE = re.compile(rb"#\?.*?\n\n[+-][XY] (\d+) [+-][XY] (\d+)\n", re.DOTALL)
"""Of RGBE files (Ward, Graphics Gems II, 1991)."""


def check_image_file(path: Path) -> None:
    """Raises SceneError for an image that has no pixels. Any other defect is left for
    Mitsuba to report."""
    try:
        with path.open("rb") as file:
            header = file.read(HEADER)
    except OSError:
        return
    for pattern in (PORTABLE, RADIANCE):
        match = pattern.match(header)
        if match and 0 in (int(match[1]), int(match[2])):
            size = f"{int(match[1])}x{int(match[2])}"
            raise SceneError(f"image '{path}' has {size} pixels: export it anew")
