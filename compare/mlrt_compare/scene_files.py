"""The scenes that a command is to take, files or all in folders."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

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
    base = common_folder(scenes)
    return [scene.absolute().relative_to(base).as_posix() for scene in scenes]


def common_folder(scenes: Sequence[Path]) -> Path:
    """The folder that holds all, itself or in others."""
    return Path(os.path.commonpath([str(scene.absolute().parent) for scene in scenes]))


def told_from(figures: Any, folder: Path) -> Any:
    """The same, with the paths in texts told from a folder: of a dictionary or a list those
    in it."""
    if isinstance(figures, dict):
        return {key: told_from(value, folder) for key, value in figures.items()}
    if isinstance(figures, list | tuple):
        return [told_from(value, folder) for value in figures]
    return figures.replace(f"{folder}{os.sep}", "") if isinstance(figures, str) else figures
