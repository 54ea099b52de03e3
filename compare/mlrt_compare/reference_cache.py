"""Keeps arrays that took long to compute, from one run to the next."""

from __future__ import annotations

import hashlib
import io
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .options import CannotRun

Arrays = dict[str, NDArray[np.float64]]


def default_cache() -> Path:
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "mlrt-compare"


class ReferenceCache:
    """Files in a folder, of which the name tells all that the content depends on.

    Any of them may be deleted at any time. Raises CannotRun if the folder cannot be made.
    """

    def __init__(self, folder: Path | None) -> None:
        self.folder = default_cache() if folder is None else folder
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CannotRun(
                f"the cache folder {self.folder} cannot be made ({error.strerror}): name "
                "another with --cache"
            ) from error

    def path(self, *parts: object) -> Path:
        """The file for what depends on ``parts``."""
        name = hashlib.sha256(repr(parts).encode()).hexdigest()[:32]
        return self.folder / f"{name}.npz"

    def load(self, path: Path) -> Arrays | None:
        """What was stored there; None if nothing was, or if the file is damaged."""
        try:
            stream = io.BytesIO(path.read_bytes())
            with np.load(stream, allow_pickle=False) as stored:
                return {name: np.array(stored[name]) for name in stored.files}
        except (OSError, ValueError, EOFError, zipfile.BadZipFile):
            return None

    def store(self, path: Path, arrays: Mapping[str, NDArray[np.float64]]) -> None:
        """Writes all arrays, or no file. Raises CannotRun if that is not possible."""
        try:
            with tempfile.TemporaryDirectory(dir=self.folder, prefix=".new-") as folder:
                temporary = Path(folder) / path.name
                with temporary.open("wb") as stream:
                    np.savez(stream, allow_pickle=False, **arrays)
                temporary.replace(path)
        except OSError as error:
            raise CannotRun(
                f"the cache folder {self.folder} cannot be written to ({error.strerror}): "
                "name another with --cache"
            ) from error
