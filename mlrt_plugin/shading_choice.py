"""Who shades a scene: this package, or Mitsuba's own plugins on this package's hits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .errors import MlrtError
from .integrators import native_obstacle
from .scene_arrays import Lighting
from .scene_import import SceneSource, SceneSummary, summarise

SHADINGS = ("auto", "native", "mitsuba")
"""Values of the option `shading`."""


@dataclass(frozen=True)
class ShadingChoice:
    """The path that a scene takes, `native` or `mitsuba`, and why."""

    path: str
    reason: str

    def __str__(self) -> str:
        return f"{self.path}, because {self.reason}"


def checked_shading(shading: object) -> str:
    """The option `shading`; raises MlrtError for a value that does not exist."""
    if shading not in SHADINGS:
        raise MlrtError(
            f"shading = {shading!r} does not exist: choose from {', '.join(SHADINGS)}"
        )
    return str(shading)


def choose_shading(
    scene: SceneSource,
    shading: str | None = None,
    *,
    sensor: Any = 0,
    defines: Mapping[str, object] | None = None,
    lighting: Lighting | None = None,
) -> ShadingChoice:
    """Decides for a scene; None takes what its integrator `mlrt` says, else `auto`.

    lighting: what to render in place of what the scene's integrator asks for.

    Raises SceneError if the scene cannot be parsed, MlrtError for an unknown `shading`.
    """
    summary = summarise(scene, sensor=sensor, defines=defines)
    return choice_for(summary, shading, lighting or summary.lighting)


def choice_for(
    summary: SceneSummary, shading: str | None, lighting: Lighting
) -> ShadingChoice:
    """Decides for a scene that has been looked through; see `choose_shading`."""
    if shading is None:
        shading = lighting.own_options(("shading",)).get("shading", "auto")
    shading = checked_shading(shading)
    if shading != "auto":
        return ShadingChoice(shading, "that is asked for")
    reasons = [f"{f} is not native ({f.reason})" for f in summary.features if not f.native]
    obstacle = native_obstacle(summary.features, lighting)
    if obstacle:
        reasons.append(obstacle)
    if not reasons:
        return ShadingChoice("native", "all plugins of the scene are native")
    more = len(reasons) - 1
    others = f", and {more} more" if more else ""
    return ShadingChoice("mitsuba", reasons[0] + others)
