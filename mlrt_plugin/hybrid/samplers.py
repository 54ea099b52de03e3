"""Random numbers of a part of an image, as Mitsuba draws them for the whole of it.

Mitsuba's llvm variants draw numbers for all samples of an image at once: sample s of
pixel p is number p * spp + s of that wavefront. Here a wavefront is rendered in passes.
"""

from __future__ import annotations

from typing import Any

import drjit as dr


class IndependentStream:
    """The numbers of sampler `independent`, of any run of samples: a generator PCG32 each,
    seeded by a hash of the seed and the number of the sample (pcg32.cpp)."""

    def __init__(self, module: Any, seed: int, first: int, count: int) -> None:
        self._module = module
        number = dr.arange(module.UInt32, count) + dr.opaque(module.UInt32, first)
        state, sequence = module.sample_tea_32(dr.opaque(module.UInt32, seed), number)
        self._generator = module.PCG32()
        self._generator.seed(module.UInt64(state), module.UInt64(sequence))

    def next_1d(self, active: Any = True) -> Any:
        return self._generator.next_float32(self._module.Bool(active))

    def next_2d(self, active: Any = True) -> Any:
        x = self.next_1d(active)
        return self._module.Point2f(x, self.next_1d(active))


def mitsubas_sampler(sampler: Any, spp: int, seed: int, count: int) -> Any:
    """A copy of a sampler of Mitsuba, ready for a wavefront of `count` samples."""
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
