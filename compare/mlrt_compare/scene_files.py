"""The scenes that a command is to take, files or all in folders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from .options import CannotRun


def scenes_in(paths: Sequence[Path]) -> list[Path]:
    """The files, and all XML files of the folders and the folders in them, in the order of
    their names; each once. Raises CannotRun for a folder without any."""
    found: list[Path] = []
    for path in paths:
        inside = sorted(path.rglob("*.xml")) if path.is_dir() else [path]
        if not inside:
            raise CannotRun(f"there is no XML file in the folder {path}")
        found += inside
    return list(dict.fromkeys(found))


def short_names(scenes: Sequence[Path]) -> list[str]:
    """Names of scenes in a table: their paths from the folder that holds all."""
    paths = [scene.absolute() for scene in scenes]
    if len(paths) == 1:
        return [paths[0].name]
    base = os.path.commonpath([str(path.parent) for path in paths])
    return [path.relative_to(base).as_posix() for path in paths]
