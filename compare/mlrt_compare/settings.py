"""What both renderers are asked for, word for word the same."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class Settings:
    """One image of one scene: direct illumination."""

    scene: Path
    spp: int | None = None
    """Samples a pixel; None: what the scene's sampler says."""
    seed: int = 0
    sensor: int = 0
    resolution: tuple[int, int] | None = None
    """Width and height of the film in pixels; None: what the scene says."""
    threads: int | None = None
    """Worker threads of both renderers; None: all processors."""
    shading: str | None = None
    """MLRT's option of that name; None: what the scene says, else auto."""
    folders: tuple[Path, ...] = ()
    """Folders in which files of the scene are looked for as well."""
    defines: Mapping[str, str] = field(default_factory=dict)
    """Values of the scene's $parameters."""
