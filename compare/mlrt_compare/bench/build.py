"""mlrt-bench build: what a tree costs, in seconds and bytes, and what a frame with it."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin.threads import thread_count

from .ats import traversal_steps
from .contenders import (
    EMBREE,
    LAZY,
    MLRT,
    WARM_UP_FACES,
    Contender,
    contenders_of,
    embree_device,
)
from .goals import goals_of
from .measure import ROUNDS_A_REPEAT, Run, in_turns, timed
from .native import Native
from .peak import resident_peaks
from .scenes import BenchScene
from .status import show_status
from .table import plural

BACKGROUND = 0xFFFFFFFF
LARGEST_DIFFERENCE = 1e-3
"""Of the brightness of a pixel that two engines agree on."""


@dataclass(frozen=True)
class Settings:
    threads: tuple[int, ...]
    repeats: int
    resolution: int
    """Pixels along both sides of the frame."""


@dataclass
class Frame:
    """What a contender made of the frame, seen once and not timed."""

    image: npt.NDArray[np.float32]
    primitives: npt.NDArray[np.uint32]


class SceneBenchmark:
    """All measurements of one scene."""

    def __init__(self, native: Native, scene: BenchScene, settings: Settings) -> None:
        self._native = native
        self._scene = scene
        self._settings = settings
        side = settings.resolution
        self._mesh = native.module.Mesh(scene.vertices, scene.faces)
        few = np.ascontiguousarray(scene.faces[:WARM_UP_FACES])
        self._small_mesh = native.module.Mesh(scene.vertices, few)
        self._view = native.module.View(scene.view, side, side)
        # Written to before the first frame is timed, so that its pages are there.
        self._image = np.zeros((side, side), np.float32)
        self.frames: dict[str, Frame] = {}
        self._ats: dict[str, dict[str, float]] = {}
        self._sah_costs: dict[str, float] = {}
        self._growth: dict[str, float] = {}
        self._peaks: dict[str, int | None] = {}

    def blocks(self) -> Iterator[dict[str, Any]]:
        """Figures of each number of threads, as JSON has them."""
        for threads in self._settings.threads:
            with thread_count(threads):
                yield self._block(threads)

    def summary(self) -> dict[str, Any]:
        """What does not depend on the number of threads: peak memory, cost, share that
        is built, traversal steps, agreement."""
        return {
            "resident_peak_bytes": self._peaks,
            "sah_cost": self._sah_costs,
            "built_share": self._growth,
            "ats": self._ats,
            "agreement": agreement(self.frames),
        }

    def _block(self, threads: int) -> dict[str, Any]:
        module = self._native.module
        device = embree_device(module, threads)
        contenders = contenders_of(module, device)
        for contender in contenders:
            built = contender.build(self._small_mesh)
            contender.render(built, self._view, self._image, None)
            del built
        runs = [partial(self._run, contender, threads) for contender in contenders]
        if not self._peaks:
            show_status(f"{self._scene.name}: peak memory")
            self._peaks = resident_peaks(
                self._native.library,
                self._scene,
                [contender.name for contender in contenders],
                max(self._settings.threads),
            )
        for which, run in in_turns(runs, ROUNDS_A_REPEAT * self._settings.repeats):
            contenders[which].runs.append(run)
        show_status("")
        block = {
            "threads": threads,
            "embree": {
                "version": device.version,
                "native_packets_of_16": device.has_native_packets,
            },
            "contenders": [
                {
                    "name": contender.name,
                    **contender.facts,
                    "runs": [run.as_dict() for run in contender.runs],
                }
                for contender in contenders
            ],
        }
        block["goals"] = [
            goal.as_dict() for goal in goals_of(self._scene.name, block, self._sah_costs)
        ]
        return block

    def _run(self, contender: Contender, threads: int) -> Run | None:
        if not contender.needs_run(self._settings.repeats):
            return None
        show_status(
            f"{self._scene.name}, {plural(threads)}: {contender.name}, run "
            f"{len(contender.runs) + 1}"
        )
        gc.collect()
        self._native.module.release_memory()
        built, build = timed(
            lambda: contender.build(self._mesh), lambda result: result.seconds
        )
        _, frame = timed(
            lambda: contender.render(built, self._view, self._image, None),
            lambda seconds: seconds,
        )
        contender.facts = {"bytes": int(built.bytes)}
        wide = None
        if contender.engine == MLRT and contender.kind != LAZY:
            form, wide = timed(built.make_wide_form, lambda made: made.seconds)
            contender.facts["wide_bytes"] = int(form.bytes)
            del form
        if contender.engine == MLRT:
            contender.facts |= {"state": dict(built.state), "report": dict(built.report)}
        else:
            contender.facts["peak_bytes"] = int(built.peak_bytes)
        if contender.name not in self.frames:
            self._inspect(contender, built)
        parts = [part for part in (build, frame, wide) if part is not None]
        return Run(build, frame, any(part.busy(threads) for part in parts), wide)

    def _inspect(self, contender: Contender, built: Any) -> None:
        primitives = np.zeros(self._image.shape, np.uint32)
        contender.render(built, self._view, self._image, primitives)
        self.frames[contender.name] = Frame(self._image.copy(), primitives)
        if contender.engine != MLRT:
            return
        if contender.kind == LAZY:
            self._growth = growth(built)
        else:
            self._sah_costs[contender.name] = float(built.sah_cost())
            self._ats[contender.name] = {
                "with_entry_points": self._steps(built, True),
                "from_the_root": self._steps(built, False),
            }

    def _steps(self, tree: Any, entry_points: bool) -> float:
        options = {"traversal": "interval", "entry_points": entry_points}
        return traversal_steps(tree, self._view, self._image.size, options)


def growth(tree: Any) -> dict[str, float]:
    """The shares of a lazy tree's nodes and references that are built; builds the rest."""
    now = dict(tree.state)
    tree.finish()
    whole = dict(tree.state)
    return {key: now[key] / max(whole[key], 1) for key in ("nodes", "references")}


def agreement(frames: dict[str, Frame]) -> dict[str, Any]:
    """Whether MLRT's trees give one image, and where it differs from Embree's.

    primitive: pixels where different triangles are hit, of which `hit` where only one
    engine hits any; image: pixels whose brightness differs.
    """
    own = [frame for name, frame in frames.items() if name.startswith(MLRT)]
    same = all(
        np.array_equal(frame.primitives, own[0].primitives)
        and np.array_equal(frame.image.view(np.uint32), own[0].image.view(np.uint32))
        for frame in own
    )
    peer = frames[f"{EMBREE} MEDIUM"]
    a, b = own[0].primitives, peer.primitives
    return {
        "mlrt_trees_give_one_image": same,
        "pixels": int(a.size),
        "differing": {
            "primitive": int(np.count_nonzero(a != b)),
            "hit": int(np.count_nonzero((a == BACKGROUND) != (b == BACKGROUND))),
            "image": int(
                np.count_nonzero(np.abs(own[0].image - peer.image) > LARGEST_DIFFERENCE)
            ),
        },
    }
