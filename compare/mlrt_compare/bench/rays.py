"""mlrt-bench rays: the same primary and shadow rays by MLRT and by each mode of Embree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin.threads import thread_count

from .ats import baselines
from .build import BACKGROUND, LARGEST_DIFFERENCE
from .contenders import QUALITIES, embree_device
from .frame_runs import FrameRun, FrameSettings, measured_in_turns, timed_frames
from .measure import Timing
from .native import Native
from .rays_contenders import (
    RayContender,
    Variant,
    choose_variant,
    less_exact_contender,
    ray_contenders,
)
from .rays_goals import cost_of_exactness, cost_of_watertightness, ray_speedup
from .scenes import BenchScene
from .status import show_status
from .table import plural

RUN_SECONDS = 0.05
"""Frames of a run follow one another for about that long, so that each contender has its
data in the caches; chosen."""
ENOUGH_SECONDS = 6.0
"""A contender whose frames took longer than that in all is not run again, once it has run
twice; chosen, for millions of triangles and 16 samples a pixel."""

GRIDS = {1: 1, 16: 4}
"""Rays along both sides of a pixel, by samples."""


@dataclass(frozen=True)
class Settings(FrameSettings):
    tiles: tuple[int, ...]
    trace: dict[str, Any]
    """Options of MLRT's tracer, where they are not the usual ones."""
    same_isa: bool = False
    """Whether Embree is limited to the instruction set of MLRT."""


@dataclass
class Traced:
    """What became of each ray of a frame."""

    primitives: npt.NDArray[np.uint32]
    lit: npt.NDArray[np.uint8]
    image: npt.NDArray[np.float32]

    @property
    def hit(self) -> npt.NDArray[np.bool_]:
        return np.asarray(self.primitives != BACKGROUND)


class RayBenchmark:
    """All measurements of one scene. ``less_exact``: native sides of other kinds of MLRT
    that are to be measured as well."""

    def __init__(
        self,
        native: Native,
        scene: BenchScene,
        settings: Settings,
        less_exact: Mapping[str, Native] | None = None,
    ) -> None:
        self._module = native.module
        self._scene = scene
        self._settings = settings
        side = settings.resolution
        most = max(settings.threads)
        with thread_count(most):
            show_status(f"{scene.name}: building")
            self._mesh = self._module.Mesh(scene.vertices, scene.faces)
            self._tree = self._module.KdTree(self._mesh, {"builder": "auto"})
            self._tree.widen()
            # Rays are traced by threads of our own, however many Embree builds with.
            isa = str(self._module.isa) if settings.same_isa else None
            self._device = embree_device(self._module, most, isa)
            self._embree = {
                quality: self._module.EmbreeScene(
                    self._device, self._mesh, quality == "HIGH"
                )
                for quality in QUALITIES
            }
            self._less_exact: dict[str, tuple[ModuleType, Any]] = {}
            for kind, other in (less_exact or {}).items():
                mesh = other.module.Mesh(scene.vertices, scene.faces)
                tree = other.module.KdTree(mesh, {"builder": "auto"})
                tree.widen()
                self._less_exact[kind] = (other.module, tree)
        self._image = np.zeros((side, side), np.float32)

    def facts(self) -> dict[str, Any]:
        """What does not depend on threads and samples."""
        show_status(f"{self._scene.name}: counting steps")
        side = self._settings.resolution
        view = self._module.View(self._scene.view, side, side)
        with thread_count(max(self._settings.threads)):
            ats = baselines(
                self._tree, view, side * side, self._settings.trace, self._scene.name
            )
        show_status("")
        return {
            "embree": {
                "version": self._device.version,
                "native_packets_of_16": self._device.has_native_packets,
            },
            "bytes": {
                "MLRT": int(self._tree.bytes),
                **{name: int(scene.bytes) for name, scene in self._embree.items()},
            },
            "report": dict(self._tree.report),
            "ats": ats,
        }

    def blocks(self) -> Iterator[dict[str, Any]]:
        """Figures of each number of samples, kind of rays and number of threads, as JSON
        has them."""
        for spp in self._settings.spp:
            grid = GRIDS[spp]
            side = self._settings.resolution
            view = self._module.View(self._scene.view, side, side, grid)
            for shadows in (False, True):
                contenders = ray_contenders(
                    self._tree,
                    self._embree,
                    self._settings.trace,
                    self._settings.tiles,
                )
                contenders += [
                    less_exact_contender(
                        kind,
                        tree,
                        module.View(self._scene.view, side, side, grid),
                        self._settings.trace,
                        self._settings.tiles,
                    )
                    for kind, (module, tree) in self._less_exact.items()
                ]
                with thread_count(max(self._settings.threads)):
                    facts = self._agreement(contenders, view, spp, shadows)
                with thread_count(1):
                    self._tune(contenders, view, shadows)
                for threads in self._settings.threads:
                    with thread_count(threads):
                        self._measure(contenders, view, shadows, threads)
                    show_status("")
                    yield self._block(contenders, facts, spp, shadows, threads)

    def _render(self, variant: Variant, view: Any, shadows: bool, frames: int) -> Timing:
        """Seconds of one frame, the mean of some in a row."""
        return timed_frames(
            lambda: variant.render(view, self._image, shadows=shadows), frames
        )

    def _tune(self, contenders: list[RayContender], view: Any, shadows: bool) -> None:
        """Finds the quickest variant of each contender, by CPU time, which others that are
        at work disturb least."""
        for contender in contenders:
            show_status(f"{self._scene.name}: choosing tiles of {contender.name}")
            choose_variant(
                contender, lambda variant: self._render(variant, view, shadows, 1)
            )

    def _measure(
        self, contenders: list[RayContender], view: Any, shadows: bool, threads: int
    ) -> None:
        def run(contender: RayContender, number: int) -> FrameRun:
            show_status(
                f"{self._scene.name}, {plural(threads)}: {contender.name}, run {number + 1}"
            )
            assert contender.chosen is not None
            expected = min(trial["wall"] for trial in contender.tuning)
            frames = max(1, round(RUN_SECONDS / max(expected, 1e-6)))
            timing = self._render(contender.chosen, view, shadows, frames)
            return FrameRun(timing, frames, timing.busy(threads))

        runs = measured_in_turns(
            [partial(run, contender) for contender in contenders],
            self._settings.repeats,
            ENOUGH_SECONDS,
        )
        for contender, done in zip(contenders, runs, strict=True):
            contender.runs = done

    def _agreement(
        self, contenders: list[RayContender], view: Any, spp: int, shadows: bool
    ) -> dict[str, dict[str, Any]]:
        """Where each contender differs from MLRT, by its name; of MLRT, whether all tiles
        give one image."""
        own, *peers = contenders
        show_status(f"{self._scene.name}: comparing hits")
        traced, *others = (
            self._traced(variant, view, spp, shadows) for variant in own.variants
        )
        found: dict[str, dict[str, Any]] = {
            own.name: {
                "differing": difference(traced, traced),
                "rays": {
                    "primary": int(traced.primitives.size),
                    "shadow": int(np.count_nonzero(traced.hit)) if shadows else 0,
                },
                "tiles_give_one_image": all(same(traced, other) for other in others),
            }
        }
        for peer in peers:
            # Calls of one mode find the same hits, whatever the tile.
            seen = self._traced(peer.variants[0], view, spp, shadows)
            found[peer.name] = {"differing": difference(traced, seen)}
        return found

    def _traced(self, variant: Variant, view: Any, spp: int, shadows: bool) -> Traced:
        side = self._settings.resolution * GRIDS[spp]
        primitives = np.zeros((side, side), np.uint32)
        lit = np.zeros((side, side), np.uint8)
        variant.render(view, self._image, primitives=primitives, lit=lit, shadows=shadows)
        return Traced(primitives, lit, self._image.copy())

    def _block(
        self,
        contenders: list[RayContender],
        facts: dict[str, dict[str, Any]],
        spp: int,
        shadows: bool,
        threads: int,
    ) -> dict[str, Any]:
        own = facts[contenders[0].name]
        block: dict[str, Any] = {
            "threads": threads,
            "spp": spp,
            "shadows": shadows,
            "rays": own["rays"],
            "mlrt_tiles_give_one_image": own["tiles_give_one_image"],
            "contenders": [
                {
                    "name": contender.name,
                    "engine": contender.engine,
                    "call": contender.chosen.call if contender.chosen else None,
                    "tile": contender.chosen.tile if contender.chosen else None,
                    "differing": facts[contender.name]["differing"],
                    "tuning": contender.tuning,
                    "runs": [run.as_dict() for run in contender.runs],
                }
                for contender in contenders
            ],
        }
        block["speedup"] = ray_speedup(self._scene.name, block).as_dict()
        block["exactness"] = cost_of_exactness(block)
        block["watertightness"] = cost_of_watertightness(block)
        return block


def difference(own: Traced, peer: Traced) -> dict[str, int]:
    """Counts of rays: where only one engine hits anything (hit), where both hit different
    triangles (triangle), where both hit and only one sees the light (lit); and of pixels
    whose brightness differs (image)."""
    both = own.hit & peer.hit
    return {
        "hit": int(np.count_nonzero(own.hit != peer.hit)),
        "triangle": int(np.count_nonzero(both & (own.primitives != peer.primitives))),
        "lit": int(np.count_nonzero(both & (own.lit != peer.lit))),
        "image": int(np.count_nonzero(np.abs(own.image - peer.image) > LARGEST_DIFFERENCE)),
    }


def same(a: Traced, b: Traced) -> bool:
    return (
        np.array_equal(a.primitives, b.primitives)
        and np.array_equal(a.lit, b.lit)
        and np.array_equal(a.image.view(np.uint32), b.image.view(np.uint32))
    )
