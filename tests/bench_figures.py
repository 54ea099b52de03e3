"""Figures such as `mlrt-bench build` writes, made up."""

from __future__ import annotations

from typing import Any


def run(build: float, frame: float, busy: bool = False) -> dict[str, Any]:
    return {
        "build": {"wall": build, "cpu": build, "waited": 0.0},
        "frame": {"wall": frame, "cpu": frame, "waited": 0.0},
        "busy": busy,
    }


def block(threads: int = 1, **runs: list[dict[str, Any]]) -> dict[str, Any]:
    """Five contenders of which each builds 1000 bytes in a second and renders in another,
    but for the runs that are given by kind."""
    names = {
        "exact": "MLRT exact",
        "fast": "MLRT fast",
        "lazy": "MLRT lazy",
        "medium": "Embree MEDIUM",
        "high": "Embree HIGH",
    }
    return {
        "threads": threads,
        "contenders": [
            {"name": name, "bytes": 1000, "runs": runs.get(kind, [run(1.0, 1.0)])}
            for kind, name in names.items()
        ],
        "goals": [],
    }
