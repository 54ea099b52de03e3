"""Who traces rays: MLRT, and Embree in each of its modes and build qualities."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from .contenders import EMBREE, MLRT, QUALITIES
from .frame_runs import FrameRun
from .measure import Timing, best

INEXACT, WATERTIGHT = "inexact", "watertight"
"""Kinds of MLRT that trust single precision: in all, and in distances alone."""
EMBREE_MODES = {"r16": ("r16",), "NM": ("NM8", "NM16"), "1M": ("1M",)}
"""Ways in which Embree takes many rays, by what the native side calls their variants:
coherent packets of 16, coherent streams of packets of 8 or 16, incoherent streams."""
TUNING_SECONDS, TUNING_FRAMES = 0.3, 5
"""A variant is tried until it has had either; chosen."""
LEAST_TUNING_FRAMES = 3
"""That it is tried for however long they take, unless it is out of the question; chosen."""
OUT_OF_THE_QUESTION = 1.5
"""Times the least CPU time of the others, once each has had a frame; chosen."""
Render = Callable[..., Any]
"""Of the view, the image and keywords; returns seconds."""


@dataclass(frozen=True)
class Variant:
    """A way to call a tracer that changes nothing but its speed."""

    call: str
    tile: int
    """Rays along the side of what is handed over at once."""
    render: Render


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


def mlrt_variant(
    tree: Any, trace: dict[str, Any], tile: int, own_view: Any = None
) -> Variant:
    """``own_view``: in place of the view that is given when it runs."""

    def render(view: Any, image: Any, **keywords: Any) -> Any:
        chosen = view if own_view is None else own_view
        return tree.render(chosen, trace, image, tile=tile, **keywords)

    return Variant("group", tile, render)


def ray_contenders(
    tree: Any, scenes: dict[str, Any], trace: dict[str, Any], tiles: Sequence[int]
) -> list[RayContender]:
    """``scenes``: Embree's, by build quality. ``trace``: options of MLRT's tracer."""

    def embree(scene: Any, call: str, tile: int) -> Variant:
        return Variant(
            call,
            tile,
            lambda view, image, **keywords: scene.render(
                view, image, mode=call, tile=tile, **keywords
            ),
        )

    contenders = [
        RayContender(MLRT, "", [mlrt_variant(tree, trace, tile) for tile in tiles])
    ]
    for quality in QUALITIES:
        for mode, calls in EMBREE_MODES.items():
            # A packet is traced as soon as it is made, whatever the tile.
            sides = tiles if mode != "r16" else (max(tiles),)
            variants = [
                embree(scenes[quality], call, tile) for call in calls for tile in sides
            ]
            contenders.append(RayContender(EMBREE, f"{quality} {mode}", variants))
    return contenders


def less_exact_contender(
    kind: str, tree: Any, view: Any, trace: dict[str, Any], tiles: Sequence[int]
) -> RayContender:
    """MLRT with a core of the given kind; tree and view are of its module."""
    variants = [mlrt_variant(tree, trace, tile, view) for tile in tiles]
    return RayContender(MLRT, kind, variants)


def choose_variant(contender: RayContender, frame: Callable[[Variant], Timing]) -> None:
    """Finds the variant of which a frame takes the least CPU time, and keeps the trials.

    They are rendered in turns; one that is far behind after its first frame has no more.
    """
    trials: dict[Variant, list[Timing]] = {variant: [] for variant in contender.variants}

    def least(variant: Variant) -> float:
        return best(each.cpu for each in trials[variant])

    left = list(contender.variants)
    while left:
        for variant in left:
            trials[variant].append(frame(variant))
        limit = OUT_OF_THE_QUESTION * min(map(least, trials))
        left = [
            variant
            for variant in left
            if needs_trial(trials[variant]) and least(variant) <= limit
        ]
    contender.chosen = min(trials, key=least)
    contender.tuning += [
        {
            "call": variant.call,
            "tile": variant.tile,
            "wall": best(each.wall for each in frames),
            "cpu": least(variant),
            "frames": len(frames),
        }
        for variant, frames in trials.items()
    ]


def needs_trial(frames: Sequence[Timing]) -> bool:
    if len(frames) < LEAST_TUNING_FRAMES:
        return True
    spent = sum(each.wall for each in frames)
    return len(frames) < TUNING_FRAMES and spent < TUNING_SECONDS
