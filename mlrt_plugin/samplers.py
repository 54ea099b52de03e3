"""Samplers of a loaded scene, and how many samples they take."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from . import mitsuba_objects as objects
from .errors import MlrtError, SceneError, UnsupportedFeature
from .features import SAMPLERS
from .options import integer
from .scene_arrays import Sampler

LARGEST_NUMBER = 2**32 - 1
"""Samples of an image, which all samplers but `independent` number in 32 bits."""


def read_sampler(
    sampler: Any, name: str, properties: Mapping[str, Any]
) -> tuple[Sampler, int]:
    """Reads a sampler and its own seed; raises UnsupportedFeature if there is no native one
    like it.

    properties: of its element in the scene's file, empty if the scene came loaded. Samplers
    other than `independent` do not tell their seed then: 0 is taken, which changes the
    noise and nothing else.
    """
    plugin = objects.plugin_name(sampler)
    if plugin not in SAMPLERS:
        raise UnsupportedFeature(
            f"{name} is not supported: only {', '.join(SAMPLERS)} are so far"
        )
    jitter = objects.described(sampler, "jitter", "1")
    seed = properties.get("seed", objects.described(sampler, "base_seed", "0"))
    return Sampler(plugin, jitter.lower() not in ("0", "false")), int(seed)


def possible_spp(sampler: Sampler, spp: int, pixels: int) -> int:
    """The number of samples a pixel that a sampler takes when asked for `spp`: as Mitsuba,
    the next that it can take.

    pixels: of the image. Raises MlrtError if there are too many samples to be numbered.
    """
    match sampler.type:
        case "stratified":
            possible = ceiled_root(spp) ** 2
        case "multijitter":
            rows = math.isqrt(spp)
            possible = rows * -(-spp // rows)
        case "orthogonal":
            side = max(2, ceiled_root(spp))
            while any(side % i == 0 for i in range(2, math.isqrt(side) + 1)):
                side += 1
            possible = side**2
        case "ldsampler":
            possible = (1 << max(1, (ceiled_root(spp) - 1).bit_length())) ** 2
        case _:
            return spp
    if possible * pixels > LARGEST_NUMBER:
        raise MlrtError(
            f"spp = {spp} is too many for sampler '{sampler.type}', which numbers all "
            f"samples of the image in 32 bits: choose sampler independent"
        )
    return possible


def ceiled_root(number: int) -> int:
    """The least whole number whose square is not less."""
    return math.isqrt(number - 1) + 1 if number > 0 else 0


def rounded(sampler: str, asked: int, taken: int) -> tuple[str, ...]:
    """What there is to say of samples per pixel that are not as many as were asked for."""
    if taken == asked:
        return ()
    return (f"sampler '{sampler}' takes {taken} samples a pixel in place of {asked}",)


def checked_spp(spp: int) -> int:
    """The number of samples; raises MlrtError unless there is at least one, and TypeError
    for anything but a whole number."""
    spp = integer(spp, "spp")
    if spp < 1:
        raise MlrtError(f"spp = {spp} is too few: at least 1 sample per pixel is needed")
    if spp > 0xFFFFFFFF:
        raise MlrtError(f"spp = {spp} is too many: it must be below 2**32")
    return spp


def own_spp(spp: int, sampler: str) -> int:
    """The number of samples that a scene's sampler, of that name, says; raises SceneError
    for none."""
    if spp < 1:
        raise SceneError(
            f"{sampler or 'the sampler'} has sample_count = {spp}, so its image would have "
            "no samples: set it to 1 or more, or choose another number with --spp (spp=)"
        )
    return checked_spp(spp)
