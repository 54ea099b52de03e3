"""Speed against error: a scene by both renderers over numbers of samples, in rounds."""

from __future__ import annotations

import itertools
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

import drjit as dr
import numpy as np

from mlrt_plugin._dispatch import core
from mlrt_plugin.progress import ProgressBar
from mlrt_plugin.threads import thread_count

from .batch_reference import BatchReference, batch_reference
from .bias import BiasTest, bias_test
from .disputed_tiles import DisputedTiles, without_disputes
from .error_curves import Runs
from .metrics import REL_MSE_EPSILON
from .mitsuba_renderer import MitsubaRenderer
from .mlrt_renderer import MlrtRenderer
from .reference_cache import ReferenceCache
from .renderers import Renderer
from .scene_hash import file_hash, scene_hash
from .seeds import spread_seeds
from .settings import Settings
from .timing import LEAST_SECONDS, frames_in_a_row

T = TypeVar("T")

TRIALS = 3
"""Frames of which the fastest tells how many go into a measurement."""
BATCHES = 64
"""Renders of a reference, each with other random numbers."""
REFERENCE_SEEDS = (2**32, 2**32 + 1)
"""Where the seeds of both references start: beyond those that a user can choose for the
runs."""


@dataclass(frozen=True)
class Plan:
    """What is measured."""

    spp: tuple[int, ...]
    rounds: int
    reference_factor: int
    """Samples of a reference over the largest of ``spp``."""
    least_seconds: float = LEAST_SECONDS
    """That a measurement of time lasts, of as many frames in a row."""


@dataclass(frozen=True)
class Cold:
    """Seconds of what is done once."""

    load: float
    build: float | None
    first: tuple[float, ...]
    """First frame with each number of samples, kernels compiled where they are needed."""


@dataclass(frozen=True)
class SpeedError:
    """All that was measured; sides are MLRT and Mitsuba, in this order."""

    settings: Settings
    plan: Plan
    names: tuple[str, str]
    size: tuple[int, int]
    threads: int
    cold: tuple[Cold, Cold]
    references: tuple[BatchReference, BatchReference]
    frames: tuple[int, ...]
    """In a row, (S,), of which a time is the mean."""
    runs: tuple[Runs, Runs]
    """Errors against the reference by Mitsuba, and against that by MLRT."""
    rel_mse: np.ndarray[Any, np.dtype[np.float64]]
    """(2, S, rounds) relative MSE against the reference by Mitsuba."""
    bias: BiasTest
    disputed: DisputedTiles | None
    """What becomes of a bias without tiles of disputed rays; None if there is none."""
    kernels_from_disk: int
    """Kernels of Mitsuba's first frame that an earlier process had compiled."""
    warnings: tuple[str, ...]


def measure(settings: Settings, plan: Plan, cache: ReferenceCache) -> SpeedError:
    """Renders references, unless the cache has them, and then all rounds.

    Raises MlrtError if a side cannot load the scene, CannotRun if the cache cannot be
    written.
    """
    count = len(plan.spp)
    steps = 2 + 2 * BATCHES + 2 * count * (1 + TRIALS + plan.rounds)
    with thread_count(settings.threads), ProgressBar("speed and error") as bar:
        done = 0

        def step() -> None:
            nonlocal done
            done += 1
            bar(done / steps)

        def stepped(action: Callable[[], T]) -> T:
            result = action()
            step()
            return result

        mlrt = stepped(lambda: MlrtRenderer(settings))
        mitsuba = stepped(lambda: MitsubaRenderer(settings, mlrt.integrator))
        renderers: tuple[Renderer, Renderer] = (mlrt, mitsuba)
        first = [
            tuple(stepped(partial(renderer.frame, spp=spp)) for spp in plan.spp)
            for renderer in renderers
        ]
        references = both_references(renderers, settings, plan, cache, step)
        done = steps - 2 * count * (TRIALS + plan.rounds)
        frames = tuple(
            frames_in_a_row(
                min(
                    stepped(partial(renderer.frame, spp=spp))
                    for renderer in renderers
                    for _ in range(TRIALS)
                ),
                plan.least_seconds,
            )
            for spp in plan.spp
        )
        seconds, mse, rel_mse = rounds(renderers, references, settings, plan, frames, step)
        threads = int(dr.thread_count())
        bias = bias_test(references[0].tiles, references[1].tiles)
        disputed = None if bias.passed else without_disputes(settings, references)
    height, width = references[0].mean.shape[:2]
    return SpeedError(
        settings=settings,
        plan=plan,
        names=(renderers[0].name, renderers[1].name),
        size=(width, height),
        threads=threads,
        cold=(
            Cold(renderers[0].load, renderers[0].build, first[0]),
            Cold(renderers[1].load, renderers[1].build, first[1]),
        ),
        references=references,
        frames=frames,
        runs=(Runs(plan.spp, seconds, mse[0]), Runs(plan.spp, seconds, mse[1])),
        rel_mse=rel_mse,
        bias=bias,
        disputed=disputed,
        kernels_from_disk=mitsuba.kernels_from_disk,
        warnings=(*renderers[0].warnings, *renderers[1].warnings),
    )


def both_references(
    renderers: tuple[Renderer, Renderer],
    settings: Settings,
    plan: Plan,
    cache: ReferenceCache,
    progress: Callable[[], object],
) -> tuple[BatchReference, BatchReference]:
    """A reference by each renderer."""
    scene = scene_hash(settings)
    codes = (
        # The version alone does not tell one build from another.
        (renderers[0].name, file_hash(Path(str(core.__file__)))),
        (renderers[1].name, version("drjit")),
    )
    spp = -(-plan.reference_factor * max(plan.spp) // BATCHES)
    found = [
        batch_reference(
            renderer,
            (*code, scene),
            cache,
            batches=BATCHES,
            spp=spp,
            seed=seed,
            progress=progress,
        )
        for renderer, code, seed in zip(renderers, codes, REFERENCE_SEEDS, strict=True)
    ]
    return found[0], found[1]


def rounds(
    renderers: tuple[Renderer, Renderer],
    references: tuple[BatchReference, BatchReference],
    settings: Settings,
    plan: Plan,
    frames: Sequence[int],
    progress: Callable[[], object],
) -> tuple[Any, Any, Any]:
    """Seconds of a frame (2, S, rounds), MSE (2 references, 2, S, rounds), relative MSE (2,
    S, rounds).

    frames: (S,) in a row, with nothing between them. Of these the time is the mean and the
    error that of the last. Both renderers take the same seeds, other ones for each frame,
    and begin in turns. Seeds of errors do not depend on how many frames come before, which
    is a matter of time. The noise of a reference, which adds to every MSE, is taken off.
    """
    shape = (2, len(plan.spp), plan.rounds)
    seconds, rel_mse, mse = np.empty(shape), np.empty(shape), np.empty((2, *shape))
    # The first is Mitsuba's: the picture that a user of Mitsuba expects.
    by_mitsuba, by_mlrt = references[1], references[0]
    weights = 1 / (by_mitsuba.mean**2 + REL_MSE_EPSILON)
    noise_of_rel = float(np.mean(by_mitsuba.variance * weights))
    seeds = spread_seeds(settings.seed, plan.rounds * sum(frames))
    judged = iter(seeds[: plan.rounds * len(frames)])
    timed_only = iter(seeds[plan.rounds * len(frames) :])
    for number in range(plan.rounds):
        for index, spp in enumerate(plan.spp):
            in_a_row = [*itertools.islice(timed_only, frames[index] - 1), next(judged)]
            order = (0, 1) if (number + index) % 2 == 0 else (1, 0)
            for side in order:
                at = (side, index, number)
                seconds[at] = statistics.fmean(
                    [renderers[side].frame(spp=spp, seed=seed) for seed in in_a_row]
                )
                image = renderers[side].image.astype(np.float64)
                squares = (image - by_mitsuba.mean) ** 2
                mse[(0, *at)] = np.mean(squares) - by_mitsuba.mse
                rel_mse[at] = np.mean(squares * weights) - noise_of_rel
                mse[(1, *at)] = np.mean((image - by_mlrt.mean) ** 2) - by_mlrt.mse
                progress()
    return seconds, mse, rel_mse


def spread(seconds: Sequence[float]) -> float:
    """How far apart runs of the same lie: between their quartiles, over the median."""
    low, _, high = statistics.quantiles(seconds, n=4)
    return (high - low) / statistics.median(seconds)


def halves(seconds: Sequence[float]) -> float:
    """A against A: medians of every other run, the greater over the smaller, minus 1."""
    medians = statistics.median(seconds[::2]), statistics.median(seconds[1::2])
    return max(medians) / min(medians) - 1
