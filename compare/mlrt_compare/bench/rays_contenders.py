"""Who traces rays: MLRT, and Embree in each of its modes and build qualities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from .contenders import EMBREE, MLRT, QUALITIES
from .measure import Timing

EMBREE_MODES = {"r16": ("r16",), "NM": ("NM8", "NM16"), "1M": ("1M",)}
"""Ways in which Embree takes many rays, by what the native side calls their variants:
coherent packets of 16, coherent streams of packets of 8 or 16, incoherent streams."""
ENOUGH_SECONDS = 6.0
"""A contender whose frames took longer than that in all is not run again, once it has run
twice; chosen, for millions of triangles and 16 samples a pixel."""
Render = Callable[..., Any]
"""Of the view, the image and keywords; returns seconds."""


@dataclass(frozen=True)
class Variant:
    """A way to call a tracer that changes nothing but its speed."""

    call: str
    tile: int
    """Rays along the side of what is handed over at once."""
    render: Render


@dataclass(frozen=True)
class FrameRun:
    """Frames in a row; the figures are those of one."""

    frame: Timing
    frames: int
    busy: bool
    """Whether others had a part of the machine meanwhile."""

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass
class RayContender:
    """An engine's mode, and what came of it."""

    engine: str
    kind: str
    """Of an Embree contender the build quality and the mode."""
    variants: Sequence[Variant]
    chosen: Variant | None = None
    """The quickest variant."""
    tuning: list[dict[str, Any]] = field(default_factory=list)
    runs: list[FrameRun] = field(default_factory=list)

    @property
    def name(self) -> str:
        return f"{self.engine} {self.kind}".strip()

    def needs_run(self, repeats: int) -> bool:
        """Whether there are fewer than ``repeats`` runs that nobody disturbed."""
        spent = sum(run.frame.wall * run.frames for run in self.runs)
        if len(self.runs) >= 2 and spent > ENOUGH_SECONDS:
            return False
        return sum(not run.busy for run in self.runs) < repeats


def ray_contenders(
    tree: Any, scenes: dict[str, Any], trace: dict[str, Any], tiles: Sequence[int]
) -> list[RayContender]:
    """``scenes``: Embree's, by build quality. ``trace``: options of MLRT's tracer."""

    def mlrt(tile: int) -> Variant:
        return Variant(
            "group",
            tile,
            lambda view, image, **keywords: tree.render(
                view, trace, image, tile=tile, **keywords
            ),
        )

    def embree(scene: Any, call: str, tile: int) -> Variant:
        return Variant(
            call,
            tile,
            lambda view, image, **keywords: scene.render(
                view, image, mode=call, tile=tile, **keywords
            ),
        )

    contenders = [RayContender(MLRT, "", [mlrt(tile) for tile in tiles])]
    for quality in QUALITIES:
        for mode, calls in EMBREE_MODES.items():
            # A packet is traced as soon as it is made, whatever the tile.
            sides = tiles if mode != "r16" else (max(tiles),)
            variants = [
                embree(scenes[quality], call, tile) for call in calls for tile in sides
            ]
            contenders.append(RayContender(EMBREE, f"{quality} {mode}", variants))
    return contenders
