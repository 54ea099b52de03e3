"""What the order costs in which arrays of rays are given: nanoseconds a ray by MLRT and by
Embree."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin import KdTree

from .camera_rays import Rays, camera_rays, morton_order
from .contenders import EMBREE, MLRT, QUALITIES, embree_device
from .frame_runs import FrameRun, measured_in_turns
from .goals import counted_runs
from .measure import best, process_timed
from .native import Native
from .scenes import BenchScene, camera_of
from .status import show_status

FloatArray = npt.NDArray[np.float32]
HitArrays = tuple[FloatArray, npt.NDArray[np.uint32]]
Trace = Callable[[FloatArray, FloatArray], HitArrays]
BACKGROUND = np.uint32(0xFFFFFFFF)
SEED = 20261128
ARRAY_MODES = ("r16 coherent", "r16 incoherent", "1M incoherent")
"""Of Embree: packets of 16 rays, which it is told are coherent or not, and streams of
single rays."""
ENOUGH_SECONDS = 10.0
"""Runs that took longer than that in all are not repeated, once there are two; chosen."""
OFF_THE_SURFACE = 1 - 2.0**-10
"""Where rays start that leave a hit, as a share of the way to it; chosen."""


def measure_orders(
    native: Native, scene: BenchScene, side: int, threads: int, repeats: int
) -> list[dict[str, Any]]:
    """A row for each order: all contenders with their runs and the rays for which they
    differ from MLRT in hit or miss, and nanoseconds a ray of the best runs."""
    tracers = contenders(native, scene, threads)
    rows = []
    for order, (origins, directions) in orders_of(scene, side, tracers[MLRT]).items():
        hits = {name: trace(origins, directions) for name, trace in tracers.items()}
        missed = hits[MLRT][1] == BACKGROUND
        runs = measured_in_turns(
            [
                partial(run, trace, origins, directions, threads, f"{scene.name}, {order}")
                for trace in tracers.values()
            ],
            repeats,
            ENOUGH_SECONDS,
        )
        found = [
            {
                "name": name,
                "differing": int(((hits[name][1] == BACKGROUND) != missed).sum()),
                "runs": [each.as_dict() for each in done],
            }
            for name, done in zip(tracers, runs, strict=True)
        ]
        rows.append(
            {
                "order": order,
                "rays": len(origins),
                "contenders": found,
                "nanoseconds": nanoseconds(found, len(origins)),
            }
        )
    show_status("")
    return rows


def nanoseconds(found: list[dict[str, Any]], rays: int) -> dict[str, Any]:
    """A ray, by the best runs that count: of MLRT, and of Embree in its best mode."""

    def of(contender: dict[str, Any]) -> float:
        walls = (each["frame"]["wall"] for each in counted_runs(contender))
        return 1e9 * best(walls) / rays

    own, *peers = found
    fastest = min(peers, key=of)
    return {MLRT: of(own), EMBREE: of(fastest), "mode": fastest["name"]}


def run(
    trace: Trace,
    origins: FloatArray,
    directions: FloatArray,
    threads: int,
    status: str,
    number: int,
) -> FrameRun:
    show_status(f"{status}, run {number + 1}")
    timing = process_timed(partial(trace, origins, directions))
    return FrameRun(timing, 1, timing.busy(threads))


def contenders(native: Native, scene: BenchScene, threads: int) -> dict[str, Trace]:
    """MLRT as it traces by default, barycentric coordinates included, then Embree in each
    of its modes. Arrays are read and written by all of them. MLRT's tree has its wide form
    beforehand."""
    tree = KdTree(scene.vertices, scene.faces)
    tree.widen()

    def mlrt(origins: FloatArray, directions: FloatArray) -> HitArrays:
        hits = tree.closest_hit(origins, directions)
        return hits.t, hits.primitive.view(np.uint32)

    mesh = native.module.Mesh(scene.vertices, scene.faces)
    device = embree_device(native.module, threads)

    def embree(quality: str, mode: str) -> Trace:
        built: Any = native.module.EmbreeScene(device, mesh, quality == "HIGH")

        def closest_hit(origins: FloatArray, directions: FloatArray) -> HitArrays:
            t = np.empty(len(origins), np.float32)
            face = np.empty(len(origins), np.uint32)
            built.closest_hit(origins, directions, t, face, mode)
            return t, face

        return closest_hit

    return {MLRT: mlrt} | {
        f"{EMBREE} {quality}, {mode}": embree(quality, mode)
        for quality in QUALITIES
        for mode in ARRAY_MODES
    }


def orders_of(
    scene: BenchScene, side: int, trace: Trace
) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Origins and directions, (N, 3) each, by the name of their order: camera rays through
    the centres of side * side pixels in three orders, and rays from what they hit in
    directions that have nothing in common."""
    rays = camera_rays(camera_of(scene.view), side)
    random = np.random.default_rng(SEED)
    lines = np.arange(side * side)
    places = {
        "camera, line by line": lines,
        "camera, in Morton order": morton_order(side),
        "camera, shuffled": random.permutation(lines),
    }
    orders = {}
    for name, place in places.items():
        origins, directions, *_ = rays.ordered(place)
        orders[name] = (origins, directions)
    orders["from hits, random directions"] = bounced(rays, trace, random)
    return orders


def bounced(
    rays: Rays, trace: Trace, random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """From just before each hit, line by line, in directions over the whole sphere."""
    origins, directions, *_ = rays.ordered(np.arange(len(rays.directions)))
    t, face = trace(origins, directions)
    hit = face != BACKGROUND
    reach = OFF_THE_SURFACE * t[hit, None].astype(np.float64)
    starts = (origins[hit] + reach * directions[hit]).astype(np.float32)
    return starts, random.normal(size=starts.shape).astype(np.float32)
