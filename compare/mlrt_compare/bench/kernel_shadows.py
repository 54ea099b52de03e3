"""Pixels that shadow rays get wrong, by the test of triangles and by the offset."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin._dispatch import core
from mlrt_plugin.options import SHADOW_OFFSETS
from mlrt_plugin.render import PreparedScene, prepare

from .kernels import Contender, FloatArray, kernel_contenders
from .measure import best, in_turns, median
from .native import Native
from .offset_scene import Placement, hard_scene
from .offset_truth import (
    PixelSamples,
    Segments,
    judge,
    pixel_samples,
    traced_segments,
    visible,
)

PLACEMENTS = (Placement(), Placement(size=1e-3))
RESOLUTION = 128
FRAME_SAMPLES = 64
"""A pixel, of the frames that are timed; chosen, for a million rays."""
BEFORE_TARGET = float(np.float32(1 - 2.0**-23))
"""The end of a robust shadow ray (``cpp/render/shadow_offset.h``)."""


@dataclass(frozen=True)
class ShadowRays:
    """origins, directions: (N, 3) float32. end: what is hit up to there, in lengths of the
    direction, is in the way. unlit: (N,), behind the surface, whatever is in the way."""

    origins: FloatArray
    directions: FloatArray
    end: float
    unlit: npt.NDArray[np.bool_]


def study_shadows(
    native: Native, placement: Placement, resolution: int, threads: int, repeats: int
) -> list[dict[str, Any]]:
    """A row for each contender of `kernel_contenders` and each offset: what its own camera
    rays hit is joined to a point light by shadow rays that it traces itself. Wrong pixels
    are told as `mlrt-bench offsets` does; speed is that of tracing the shadow rays."""
    arrays = hard_scene("point", placement, resolution)
    prepared = prepare(arrays, shading="native")
    assert isinstance(prepared, PreparedScene)
    primitive = prepared.render(aovs=("prim",)).aovs["prim"]
    segments = traced_segments(prepared, primitive)
    expected = visible(prepared, segments)
    samples = pixel_samples(prepared)
    contenders = kernel_contenders(native, arrays.vertices, arrays.faces, threads)
    rows = []
    for contender in contenders:
        face = primary_faces(contender, samples)
        for offset in SHADOW_OFFSETS:
            pixels = np.flatnonzero(face >= 0)
            rays = shadow_rays(prepared, samples, pixels, face[pixels], offset)
            seen, seconds = unoccluded(contender, rays, repeats)
            image = np.zeros((face.size, 3), np.float32)
            image[pixels[seen]] = 1
            judgement = judge(
                prepared, segments, expected, image.reshape(*primitive.shape, 3)
            )
            rows.append(
                {
                    "name": contender.name,
                    "offset": offset,
                    "rays": len(pixels),
                    "other_hits": other_faces(segments, primitive, face),
                    "lit": judgement.lit,
                    "dark": judgement.dark,
                    "acne": judgement.acne,
                    "leaks": judgement.leaks,
                    "undecided": judgement.undecided,
                    "rays_per_second": len(pixels) / seconds,
                }
            )
    return rows


def primary_faces(contender: Contender, samples: PixelSamples) -> npt.NDArray[np.int64]:
    origins = np.repeat(samples.origin[None], len(samples.directions), axis=0)
    (_, face), _ = contender.closest_hit(origins, samples.directions)
    return face


def other_faces(segments: Segments, exact: Any, face: npt.NDArray[np.int64]) -> int:
    return int(np.count_nonzero(exact.ravel()[segments.pixel] != face[segments.pixel]))


def shadow_rays(
    prepared: PreparedScene,
    samples: PixelSamples,
    pixels: npt.NDArray[np.int64],
    faces: npt.NDArray[np.int64],
    offset: str,
) -> ShadowRays:
    """Those that the renderer makes of hits: with Mitsuba's offset from surface to light,
    as Mitsuba has them, with the robust one as the renderer traces them."""
    selftest = core.render_selftest
    origins = np.empty((len(pixels), 3), np.float32)
    directions = np.empty_like(origins)
    unlit = np.zeros(len(pixels), bool)
    for i, (pixel, face) in enumerate(zip(pixels, faces, strict=True)):
        d, light = samples.directions[pixel], samples.light[pixel]
        surface = selftest.hit_surface(prepared.handle, samples.origin, d, int(face))
        point = np.array(surface["p"], np.float32)
        normal = np.array(surface["face_normal"], np.float32)
        sample = selftest.sample_emitter(prepared.handle, point, *light)
        target = np.array(sample["target"], np.float32)
        unlit[i] = (normal @ d) * (normal @ (target - point)) >= 0
        if offset == "mitsuba":
            start = selftest.offset_point(point, normal, target - point)
        else:
            ends = selftest.robust_segment(
                prepared.handle, samples.origin, d, int(face), *light
            )
            start, target = ends["start"], ends["target"]
            if ends["from_light"]:
                start, target = target, start
        origins[i] = start
        directions[i] = np.array(target, np.float32) - origins[i]
    end = 1 - selftest.SHADOW_EPSILON if offset == "mitsuba" else BEFORE_TARGET
    return ShadowRays(origins, directions, end, unlit)


def unoccluded(
    contender: Contender, rays: ShadowRays, repeats: int
) -> tuple[npt.NDArray[np.bool_], float]:
    """Which rays reach the light, and the seconds of the best run."""
    least = np.inf
    for _ in range(repeats):
        (t, face), seconds = contender.closest_hit(rays.origins, rays.directions)
        least = min(least, seconds)
    return ~rays.unlit & ((face < 0) | (t > rays.end)), least


def time_frames(resolution: int, repeats: int) -> dict[str, Any]:
    """Whole frames by the renderer with each offset, in turns: camera and shadow rays a
    second, best and median."""
    prepared = prepare(hard_scene("point", Placement(), resolution), shading="native")
    assert isinstance(prepared, PreparedScene)

    def frame(offset: str) -> tuple[float, int]:
        start = time.perf_counter()
        result = prepared.render(spp=FRAME_SAMPLES, shadow_offset=offset)
        seconds = time.perf_counter() - start
        return seconds, result.counters["primary_rays"] + result.counters["shadow_rays"]

    rates: dict[str, list[float]] = {name: [] for name in SHADOW_OFFSETS}
    runs = [lambda name=name: frame(name) for name in SHADOW_OFFSETS]
    for which, (seconds, rays) in in_turns(runs, repeats):
        rates[SHADOW_OFFSETS[which]].append(rays / seconds)
    return {
        name: {"best": -best(-rate for rate in found), "median": median(found)}
        for name, found in rates.items()
    }


def shadow_lines(rows: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    table: list[tuple[str, ...]] = [
        ("test", "offset", "rays", "other hits", "acne", "leaks", "undecided", "Mrays/s")
    ]
    for row in rows:
        numbers = [row[key] for key in ("rays", "other_hits", "acne", "leaks", "undecided")]
        table.append(
            (
                row["name"],
                row["offset"],
                *(f"{number:,}" for number in numbers),
                f"{row['rays_per_second'] / 1e6:.2f}",
            )
        )
    return table
