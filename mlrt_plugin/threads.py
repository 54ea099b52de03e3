"""The number of threads, which Mitsuba and this package share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import drjit as dr

from .errors import MlrtError


@contextmanager
def thread_count(count: int | None) -> Iterator[None]:
    """Runs with as many threads, and restores their number; None leaves it alone.

    Raises MlrtError unless there is at least one.
    """
    if count is None:
        yield
        return
    if count < 1:
        raise MlrtError(f"threads = {count} is too few: at least 1 is needed")
    before = dr.thread_count()
    dr.set_thread_count(count)
    try:
        yield
    finally:
        dr.set_thread_count(before)
