"""What keeps a benchmark from being made."""

from __future__ import annotations


class BenchError(Exception):
    """A benchmark, or a part of it, cannot be made; the message is one sentence that says
    why and what helps."""
