"""The number of threads, which Mitsuba and this package share."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import drjit as dr

from .errors import MlrtError
from .options import integer

MAX_THREADS = 1024
"""A pool of more than that is a mistake, and may leave none for the rest of the machine."""


@contextmanager
def thread_count(count: int | None) -> Iterator[None]:
    """Runs with as many threads, and restores their number; None leaves it alone.

    Raises MlrtError unless it is from 1 to MAX_THREADS, TypeError if it is not whole.
    """
    if count is None:
        yield
        return
    count = integer(count, "threads")
    if count < 1:
        raise MlrtError(f"threads = {count} is too few: at least 1 is needed")
    if count > MAX_THREADS:
        raise MlrtError(f"threads = {count} is too many: at most {MAX_THREADS} are allowed")
    before = dr.thread_count()
    dr.set_thread_count(count)
    try:
        yield
    finally:
        dr.set_thread_count(before)


@contextmanager
def threads_for_files() -> Iterator[None]:
    """Runs with two threads at least. With one, Mitsuba 3.9.1 waits for ever when it reads
    an OpenEXR file: it leaves the decoding to another thread."""
    with thread_count(2 if dr.thread_count() < 2 else None):
        yield
