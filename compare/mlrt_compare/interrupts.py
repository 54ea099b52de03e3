"""Keeps Ctrl-C an interrupt where a library makes an error of its own of it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def interruptible() -> Iterator[None]:
    """Raises KeyboardInterrupt for an error that came of one: if it falls into what Dr.Jit
    calls, such as a frame of Mitsuba's, ``drjit.custom`` raises a RuntimeError."""
    try:
        yield
    except Exception as error:
        if came_of_interrupt(error):
            raise KeyboardInterrupt from None
        raise


def came_of_interrupt(error: BaseException) -> bool:
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None
