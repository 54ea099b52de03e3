"""One comparison: a scene rendered by MLRT and by Mitsuba with the same settings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from mlrt_plugin.progress import ProgressBar
from mlrt_plugin.threads import thread_count

from .mitsuba_renderer import MitsubaRenderer
from .mlrt_renderer import MlrtRenderer
from .settings import Settings
from .timing import DEFAULT_ROUNDS, FRAMES_OF_ROUND, Timings, interleave
from .validate import Verdict, judge

T = TypeVar("T")


@dataclass(frozen=True)
class Side:
    """What one renderer made of the scene."""

    name: str
    image: NDArray[np.float32]
    """(H, W, 3) of linear radiance."""
    timings: Timings


@dataclass(frozen=True)
class Comparison:
    """Both images, what they took, and whether they agree."""

    settings: Settings
    spp: int
    shading: str
    """Who shaded MLRT's image, and why."""
    threads: int
    llvm: str
    """Version of the libLLVM that compiled Mitsuba's kernels."""
    mlrt: Side
    mitsuba: Side
    verdict: Verdict
    warnings: tuple[str, ...]
    cost: NDArray[np.float32] | None = None
    """(H, W) MLRT's nodes and triangles for each pixel, if they were asked for."""

    def as_dict(self) -> dict[str, Any]:
        """Everything but the images, as JSON has it: a figure that is not finite is
        None."""
        height, width = self.mlrt.image.shape[:2]
        difference = self.verdict.difference
        return {
            "scene": str(self.settings.scene),
            "width": width,
            "height": height,
            "spp": self.spp,
            "seed": self.settings.seed,
            "sensor": self.settings.sensor,
            "shading": self.shading,
            "threads": self.threads,
            "llvm": self.llvm,
            "timings": [
                {"name": side.name, **side.timings.as_dict()}
                for side in (self.mlrt, self.mitsuba)
            ],
            "difference": None
            if difference is None
            else {
                key: value if math.isfinite(value) else None
                for key, value in difference.as_dict().items()
            },
            "passed": self.verdict.passed,
            "verdict": str(self.verdict),
            "warnings": list(self.warnings),
        }


def compare(
    settings: Settings, *, rounds: int = DEFAULT_ROUNDS, cost: bool = False
) -> Comparison:
    """Renders the scene on both sides and holds MLRT's image against Mitsuba's.

    After one first frame each, both render 2 ``rounds`` frames for the timings, in the
    order A B B A. A terminal shows progress, drawn between the frames: loading a side and
    each frame count as a step. ``cost`` asks for a further image of what
    tracing takes. Raises MlrtError if a side cannot load the scene.
    """
    steps = 4 + FRAMES_OF_ROUND * rounds
    with thread_count(settings.threads), ProgressBar("comparing") as bar:
        done = 0

        def step(action: Callable[[], T]) -> T:
            nonlocal done
            result = action()
            done += 1
            bar(done / steps)
            return result

        mlrt = step(lambda: MlrtRenderer(settings))
        mitsuba = step(lambda: MitsubaRenderer(settings, mlrt.integrator))
        first_mlrt, first_mitsuba = step(mlrt.frame), step(mitsuba.frame)
        frames_mlrt, frames_mitsuba = interleave(
            lambda: step(mlrt.frame), lambda: step(mitsuba.frame), rounds
        )
        threads = int(dr.thread_count())
        cost_map = mlrt.cost() if cost else None
    timings_mlrt = Timings(mlrt.load, mlrt.build, first_mlrt, frames_mlrt)
    timings_mitsuba = Timings(
        mitsuba.load,
        mitsuba.build,
        first_mitsuba,
        frames_mitsuba,
        kernels_compiled=mitsuba.kernels_compiled,
        kernels_from_disk=mitsuba.kernels_from_disk,
    )
    return Comparison(
        settings=settings,
        spp=mlrt.spp,
        shading=mlrt.shading,
        threads=threads,
        llvm=mitsuba.llvm,
        mlrt=Side(mlrt.name, mlrt.image, timings_mlrt),
        mitsuba=Side(mitsuba.name, mitsuba.image, timings_mitsuba),
        verdict=judge(mlrt.image, mitsuba.image),
        warnings=(*mlrt.warnings, *mitsuba.warnings),
        cost=cost_map,
    )
