"""A line on standard error that tells what is going on, on a terminal only."""

from __future__ import annotations

import sys

ERASE_LINE = "\r\x1b[K"


def show_status(text: str) -> None:
    """Replaces the line; an empty text takes it away."""
    if sys.stderr.isatty():
        print(f"{ERASE_LINE}{text}", end="", file=sys.stderr, flush=True)
