"""What all benchmarks do with their figures: scene by scene, shown and written."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeVar

from mlrt_files import replacing

from .errors import BenchError

FORMAT_VERSION = 1
"""Of the JSON file."""
Loaded = TypeVar("Loaded")


class Named(Protocol):
    """A scene or a mesh that can be loaded."""

    @property
    def name(self) -> str: ...


Source = TypeVar("Source", bound=Named)


def new_figures(
    benchmark: str, machine: dict[str, Any], settings: dict[str, Any]
) -> dict[str, Any]:
    return {
        "benchmark": benchmark,
        "version": FORMAT_VERSION,
        "machine": machine,
        "settings": settings,
        "scenes": [],
    }


def measure_scenes(
    figures: dict[str, Any],
    sources: Sequence[Source],
    load: Callable[[Source], Loaded],
    measure: Callable[[Loaded, dict[str, Any]], None],
    json_file: Path | None,
) -> list[dict[str, Any]]:
    """Calls measure(what was loaded, figures of the scene) for each scene and writes the
    JSON file after each, so that an interrupted run leaves what it found out.

    Scenes that cannot be loaded are skipped by name. Returns the figures of the others;
    raises BenchError if there are none.
    """
    for source in sources:
        scene: dict[str, Any] = {"name": source.name, "skipped": None}
        figures["scenes"].append(scene)
        try:
            loaded = load(source)
        except BenchError as error:
            scene["skipped"] = str(error)
            show(["", f"{source.name}: skipped, {error}"])
        else:
            measure(loaded, scene)
        write_json(json_file, figures)
    measured = [scene for scene in figures["scenes"] if scene["skipped"] is None]
    if not measured:
        raise BenchError("none of the scenes is there: nothing was measured")
    return measured


def show(lines: list[str]) -> None:
    for line in lines:
        print(line, flush=True)


def write_json(path: Path | None, figures: dict[str, Any]) -> None:
    write_text(path, json.dumps(figures, indent=1, allow_nan=False) + "\n")


def write_text(path: Path | None, text: str) -> None:
    """Writes a text, all of it or no file. Raises BenchError if that is not possible."""
    if path is None:
        return
    try:
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BenchError(f"{path} cannot be written: {error.strerror}") from error
