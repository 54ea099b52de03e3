"""mlrt-bench frames: whole frames by MLRT and by Mitsuba's llvm `direct`, the same image.

Frames are those of a steady state: after the tree has got its form for rays that go alone,
which MLRT makes on its own in one of the first frames. What that takes is told apart.

``llvm.activate`` comes before the import of this module.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Protocol

from mlrt_plugin.errors import MlrtError
from mlrt_plugin.threads import thread_count

from .. import settings as compare_settings
from ..mitsuba_renderer import MitsubaRenderer
from ..mlrt_renderer import MlrtRenderer
from ..validate import Verdict, judge
from .errors import BenchError
from .frame_runs import FrameRun, FrameSettings, measured_in_turns
from .measure import Timing, waiting_seconds
from .speedup import speedup
from .status import show_status
from .table import plural
from .widening import widen

GOALS: dict[int, dict[str, tuple[float, float]]] = {
    1: {"conference": (8.0, 15.0), "office": (12.0, 15.0)},
    16: {"conference": (5.0, 10.0), "office": (10.0, 10.0)},
}
"""Goal and stretch goal by samples a pixel and scene."""
ENOUGH_SECONDS = 40.0
"""A renderer whose frames took longer than that in all renders no more; chosen."""
WARM_UP_FRAMES = 2
"""Before any is timed: Mitsuba compiles in the first, and copies what it keeps."""


class Renderer(Protocol):
    """A side of the comparison."""

    name: str
    spp: int

    def frame(self) -> float:
        """Renders a frame and returns the seconds that it took."""


class WidenedMlrt(MlrtRenderer):
    """MLRT with the wide form of its tree, where that has one."""

    def __init__(self, settings: compare_settings.Settings) -> None:
        super().__init__(settings)
        self.widening = widen(self._prepared)


class FrameBenchmark:
    """All measurements of one scene. Raises BenchError if a side cannot load it."""

    def __init__(self, name: str, path: Path, settings: FrameSettings) -> None:
        self._name = name
        self._settings = settings
        side = settings.resolution
        wanted = compare_settings.Settings(path, resolution=(side, side), shading="native")
        show_status(f"{name}: loading")
        with thread_count(max(settings.threads)):
            try:
                self._mlrt = WidenedMlrt(wanted)
                self._mitsuba = MitsubaRenderer(wanted, self._mlrt.integrator)
            except MlrtError as error:
                raise BenchError(str(error)) from error
            finally:
                show_status("")

    def facts(self) -> dict[str, Any]:
        """What does not depend on threads and samples: seconds of making the wide form,
        None where there is none. No frame has them, unlike in `build`."""
        widening = self._mlrt.widening
        return {"wide": None if widening is None else asdict(widening)}

    def blocks(self) -> Iterator[dict[str, Any]]:
        """Figures of each number of samples and of threads, as JSON has them."""
        for spp in self._settings.spp:
            self._mlrt.spp = self._mitsuba.spp = spp
            for threads in self._settings.threads:
                with thread_count(threads):
                    block = self._block(threads)
                show_status("")
                yield {"threads": threads, "spp": spp, **block}

    def _block(self, threads: int) -> dict[str, Any]:
        renderers: tuple[Renderer, Renderer] = (self._mlrt, self._mitsuba)
        for renderer in renderers:
            for _ in range(WARM_UP_FRAMES):
                renderer.frame()

        def run(renderer: Renderer, number: int) -> FrameRun:
            show_status(
                f"{self._name}, {renderer.spp} spp, {plural(threads)}: {renderer.name}, "
                f"frame {number + 1}"
            )
            timing = timed_frame(renderer)
            return FrameRun(timing, 1, timing.busy(threads))

        runs = measured_in_turns(
            [partial(run, renderer) for renderer in renderers],
            self._settings.repeats,
            ENOUGH_SECONDS,
        )
        contenders = [
            {"name": renderer.name, "runs": [one.as_dict() for one in done]}
            for renderer, done in zip(renderers, runs, strict=True)
        ]
        goals = GOALS.get(self._mlrt.spp, {}).get(self._name, (None, None))
        return {
            "contenders": contenders,
            "verdict": verdict_dict(judge(self._mlrt.image, self._mitsuba.image)),
            "speedup": speedup(contenders[0], contenders[1:], *goals).as_dict(),
        }


def timed_frame(renderer: Renderer) -> Timing:
    """Of a frame to the finished film."""
    waited, cpu = waiting_seconds(), time.process_time()
    wall = renderer.frame()
    cpu = time.process_time() - cpu
    return Timing(wall, cpu, max(waiting_seconds() - waited, 0.0))


def verdict_dict(verdict: Verdict) -> dict[str, Any]:
    """As JSON has it: a figure that is not finite is None."""
    difference = verdict.difference
    return {
        "passed": verdict.passed,
        "text": str(verdict),
        "difference": None
        if difference is None
        else {
            key: value if math.isfinite(value) else None
            for key, value in difference.as_dict().items()
        },
    }
