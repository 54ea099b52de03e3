"""Random numbers of a part of an image, as Mitsuba draws them for the whole of it.

Mitsuba's llvm variants draw numbers for all samples of an image at once, in one wavefront:
those of sample s of pixel p have the number p * spp + s in it, which has 32 bits. Here a
wavefront is rendered in passes, and an image of more than 2^32 samples in several
wavefronts, numbered as in `cpp/render/sampler.h`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr

from ..errors import MlrtError

LARGEST_WAVEFRONT = 2**32 - 1
SEED_STEP = 0x9E3779B9
"""From one wavefront of an image to the next; 2^32 divided by the golden ratio."""
SAMPLES_OF_PASS = 2**20
"""Samples that are on their way at a time; chosen: they take some hundred bytes each."""
MOST_SUMMANDS = 4096
"""Samples of a pixel that a film of Mitsuba sums up in single precision; chosen: they lose
a few times 1e-5 of the sum."""


@dataclass(frozen=True)
class Pass:
    """A run of samples of one wavefront.

    wavefront: its number. start, spp: samples of a pixel that are taken, of stride in the
    wavefront. first, count: numbers of the samples among these, p * spp + s.
    """

    wavefront: int
    start: int
    spp: int
    stride: int
    first: int
    count: int

    def pixel_and_sample(self, module: Any) -> tuple[Any, Any]:
        """UInt32 arrays of the numbers of the pixels, and of the samples in them."""
        number = dr.arange(module.UInt32, self.count) + dr.opaque(module.UInt32, self.first)
        spp = dr.opaque(module.UInt32, self.spp)
        pixel = number // spp
        return pixel, number - pixel * spp + dr.opaque(module.UInt32, self.start)


def passes(pixels: int, spp: int, whole_pixels: bool) -> Iterator[Pass]:
    """All samples of an image, in passes of at most SAMPLES_OF_PASS, and of at most
    MOST_SUMMANDS of a pixel.

    whole_pixels: whether all samples of a pixel stay together.
    """
    size, most = SAMPLES_OF_PASS, MOST_SUMMANDS
    stride = spp
    if whole_pixels:
        size, most = max(1, SAMPLES_OF_PASS // spp) * spp, spp
    elif pixels * spp > LARGEST_WAVEFRONT:
        stride = max(1, spp // -(-pixels * spp // LARGEST_WAVEFRONT))
    for wavefront, done in enumerate(range(0, spp, stride)):
        here = min(stride, spp - done)
        for start in range(0, here, most):
            taken = min(most, here - start)
            for first in range(0, pixels * taken, size):
                count = min(size, pixels * taken - first)
                yield Pass(wavefront, start, taken, stride, first, count)


class IndependentStream:
    """The numbers of sampler `independent` for the samples of a pass: a generator PCG32
    each, seeded by a hash of the seed and the number of the sample (pcg32.cpp)."""

    def __init__(self, module: Any, seed: int, part: Pass) -> None:
        self._module = module
        pixel, sample = part.pixel_and_sample(module)
        number = pixel * dr.opaque(module.UInt32, part.stride) + sample
        own_seed = (seed + part.wavefront * SEED_STEP) & 0xFFFFFFFF
        state, sequence = module.sample_tea_32(dr.opaque(module.UInt32, own_seed), number)
        self._generator = module.PCG32()
        self._generator.seed(module.UInt64(state), module.UInt64(sequence))

    def next_1d(self, active: Any = True) -> Any:
        return self._generator.next_float32(self._module.Bool(active))

    def next_2d(self, active: Any = True) -> Any:
        x = self.next_1d(active)
        return self._module.Point2f(x, self.next_1d(active))


def mitsubas_sampler(sampler: Any, spp: int, seed: int, count: int) -> Any:
    """A copy of a sampler of Mitsuba, ready for a wavefront of `count` samples.

    Raises MlrtError if those of a pixel are more than a pass.
    """
    if spp > SAMPLES_OF_PASS:
        raise MlrtError(
            f"spp = {spp} is too many for sampler '{sampler.class_name()}', which takes at "
            f"most {SAMPLES_OF_PASS}: choose sampler independent"
        )
    copy = sampler.clone()
    copy.set_sample_count(spp)
    copy.set_samples_per_wavefront(spp)
    copy.seed(seed, count)
    return copy


def possible_spp(sampler: Any, spp: int) -> int:
    """The number of samples a pixel that a sampler takes when asked for `spp`; some need a
    square or a power of two."""
    copy = sampler.clone()
    copy.set_sample_count(spp)
    return int(copy.sample_count())
