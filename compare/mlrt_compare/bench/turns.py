"""mlrt-bench turns: frames of rays by two states of MLRT, in turns.

Both define the same types, so that each is loaded into a process of its own; only one of
the two processes works at a time.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from mlrt_plugin.threads import thread_count

from .errors import BenchError
from .frame_runs import FrameRun, FrameSettings, measured_in_turns, timed_frames
from .measure import Timing
from .native import loaded
from .rays import ENOUGH_SECONDS, GRIDS, RUN_SECONDS, Traced, difference
from .scenes import BenchScene
from .speedup import speedup
from .status import show_status
from .table import plural

NEW, BASE = "new", "base"
TILE = 64
"""Side of tiles in rays; that of which most frames take the least time."""


@dataclass(frozen=True)
class Frames:
    """What a process is asked for: so many frames in a row, or what each ray hits."""

    spp: int
    shadows: bool
    threads: int
    count: int
    hits: bool = False


class Tracer:
    """A state of MLRT with the tree of a scene, in this process."""

    def __init__(self, library: Path, scene: BenchScene, settings: FrameSettings) -> None:
        self._module = loaded(library)
        self._scene = scene
        self._side = settings.resolution
        with thread_count(max(settings.threads)):
            mesh = self._module.Mesh(scene.vertices, scene.faces)
            self._tree = self._module.KdTree(mesh, {"builder": "auto"})
            self._tree.widen()
        self._image = np.zeros((self._side, self._side), np.float32)

    def answer(self, wanted: Frames) -> Timing | Traced:
        grid = GRIDS[wanted.spp]
        view = self._module.View(self._scene.view, self._side, self._side, grid)

        def render(**outputs: Any) -> Any:
            return self._tree.render(
                view, {}, self._image, tile=TILE, shadows=wanted.shadows, **outputs
            )

        with thread_count(wanted.threads):
            if wanted.hits:
                side = self._side * grid
                primitives = np.zeros((side, side), np.uint32)
                lit = np.zeros((side, side), np.uint8)
                render(primitives=primitives, lit=lit)
                return Traced(primitives, lit, self._image)
            return timed_frames(render, wanted.count)


def serve(
    pipe: Connection, library: Path, scene: BenchScene, settings: FrameSettings
) -> None:
    """Answers until there is nobody who asks. What goes wrong is an answer as well."""
    try:
        tracer = Tracer(library, scene, settings)
        pipe.send(None)
        while True:
            pipe.send(tracer.answer(pipe.recv()))
    except (EOFError, OSError):
        return
    except Exception as error:
        pipe.send(error)


@contextmanager
def no_interrupts() -> Iterator[None]:
    """Processes that are started here leave Ctrl-C, which all processes of a terminal get,
    to this one."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


class Process:
    """A `Tracer` in a process of its own. Raises BenchError for what goes wrong there."""

    def __init__(
        self, name: str, library: Path, scene: BenchScene, settings: FrameSettings
    ) -> None:
        self.name = name
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=serve, args=(theirs, library, scene, settings), daemon=True
        )
        with no_interrupts():
            self._process.start()
        # Else nobody here would notice that the other side has ended.
        theirs.close()

    def __enter__(self) -> Process:
        self._answer(None)
        return self

    def __exit__(self, *_: object) -> None:
        self._pipe.close()
        self._process.terminate()
        self._process.join()

    def timing(self, wanted: Frames) -> Timing:
        answer = self._answer(wanted)
        assert isinstance(answer, Timing)
        return answer

    def hits(self, wanted: Frames) -> Traced:
        answer = self._answer(wanted)
        assert isinstance(answer, Traced)
        return answer

    def _answer(self, wanted: Frames | None) -> Any:
        """To a question, or whether the process is ready."""
        try:
            if wanted is not None:
                self._pipe.send(wanted)
            answer = self._pipe.recv()
        except (EOFError, OSError):
            raise BenchError(
                f"the process of {self.name} ended before it was done: it may have had too "
                "little memory"
            ) from None
        if isinstance(answer, Exception):
            raise BenchError(
                f"{self.name} cannot be measured as the other one: {answer}"
            ) from answer
        return answer


def measure_turns(
    libraries: dict[str, Path], scene: BenchScene, settings: FrameSettings
) -> Iterator[dict[str, Any]]:
    """Figures of each number of samples, kind of rays and number of threads, as JSON has
    them. libraries: of NEW and BASE."""
    with ExitStack() as stack:
        show_status(f"{scene.name}: building")
        both = [
            stack.enter_context(Process(name, libraries[name], scene, settings))
            for name in (NEW, BASE)
        ]
        for spp in settings.spp:
            for shadows in (False, True):
                show_status(f"{scene.name}: comparing hits")
                threads = max(settings.threads)
                wanted = Frames(spp, shadows, threads, 1, hits=True)
                differing = difference(*(process.hits(wanted) for process in both))
                for threads in settings.threads:
                    yield {
                        "threads": threads,
                        "spp": spp,
                        "shadows": shadows,
                        "differing": differing,
                        **timed_block(both, Frames(spp, shadows, threads, 1), settings),
                    }
        show_status("")


def timed_block(
    both: list[Process], frame: Frames, settings: FrameSettings
) -> dict[str, Any]:
    first = [process.timing(frame) for process in both]
    counts = [max(1, round(RUN_SECONDS / max(timing.wall, 1e-6))) for timing in first]

    def run(which: int, number: int) -> FrameRun:
        show_status(f"{plural(frame.threads)}: {both[which].name}, run {number + 1}")
        wanted = Frames(frame.spp, frame.shadows, frame.threads, counts[which])
        timing = both[which].timing(wanted)
        return FrameRun(timing, wanted.count, timing.busy(frame.threads))

    runs = measured_in_turns(
        [partial(run, which) for which in range(len(both))],
        settings.repeats,
        ENOUGH_SECONDS,
    )
    contenders = [
        {"name": process.name, "runs": [one.as_dict() for one in done]}
        for process, done in zip(both, runs, strict=True)
    ]
    ratios = speedup(contenders[0], contenders[1:], None, None)
    return {"contenders": contenders, "speedup": ratios.as_dict()}
