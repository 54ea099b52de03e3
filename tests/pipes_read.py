"""Named pipes that are read while something is written to them."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def reader_of(pipe: Path) -> Iterator[Callable[[], bytes]]:
    """Reads a pipe to its end meanwhile; what it yields tells what that was."""
    os.mkfifo(pipe)
    read: list[bytes] = []
    thread = threading.Thread(target=lambda: read.append(pipe.read_bytes()), daemon=True)
    thread.start()

    def told() -> bytes:
        thread.join(20)
        return b"".join(read)

    yield told
