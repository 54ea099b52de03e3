"""Random numbers equal those of Mitsuba's samplers, bit for bit."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import pytest
from mitsuba_worker import MitsubaWorker

from mlrt_plugin._dispatch import core

DIMENSIONS = 6


def own_stream(seed: int, pixels: int, samples: int) -> npt.NDArray[np.float32]:
    """Every sample of every pixel, in the order of Mitsuba's wavefront."""
    stream = core.render_selftest.sampler_stream
    return np.array(
        [
            stream(seed, pixels, samples, pixel, sample, DIMENSIONS)
            for pixel in range(pixels)
            for sample in range(samples)
        ],
        np.float32,
    )


@pytest.mark.parametrize(("seed", "samples"), [(0, 1), (7, 3), (0xFFFFFFFF, 4)])
def test_against_scalar_pcg32_and_tea(seed: int, samples: int) -> None:
    pixels = 50
    expected = []
    for index in range(pixels * samples):
        state, stream = mi.sample_tea_32(seed, index)
        random = mi.PCG32(1, state, stream)
        expected.append([random.next_float32() for _ in range(DIMENSIONS)])
    np.testing.assert_array_equal(
        own_stream(seed, pixels, samples), np.array(expected, np.float32)
    )


@pytest.mark.parametrize("drawn", [[2], [2, 1], [2, 0, 2], [0, 1, 2, 2, 2, 1]], ids=str)
def test_packets_against_scalar_pcg32(drawn: list[int]) -> None:
    random = np.random.default_rng(3)
    seeds, indices = random.integers(0, 1 << 32, (2, 16 * 5), dtype=np.uint64).tolist()
    seeds[:2], indices[:2] = [0, 0xFFFFFFFF], [0xFFFFFFFF, 0]
    expected = []
    for seed, index in zip(seeds, indices, strict=True):
        stream = mi.PCG32(1, *mi.sample_tea_32(seed, index))
        numbers = []
        for count in drawn:
            first = stream.next_float32()
            numbers += [first] if count == 1 else []
            numbers += [first, stream.next_float32()] if count == 2 else []
        expected.append(numbers)
    np.testing.assert_array_equal(
        np.array(core.render_selftest.packet_streams(seeds, indices, drawn), np.float32),
        np.array(expected, np.float32),
    )


@pytest.mark.parametrize(("seed", "samples"), [(0, 1), (123, 5)])
def test_against_the_sampler_itself(
    mitsuba_llvm: MitsubaWorker, seed: int, samples: int
) -> None:
    pixels = 200
    expected = mitsuba_llvm(
        "sampler", seed=seed, samples=samples, size=pixels * samples, dimensions=DIMENSIONS
    )
    np.testing.assert_array_equal(own_stream(seed, pixels, samples), expected)


SPREAD: dict[str, dict[str, Any]] = {
    "independent": {"sample_count": 3},
    "stratified": {"sample_count": 9},
    "stratified in the middle": {"sample_count": 4, "jitter": False},
    "multijitter": {"sample_count": 12},
    "multijitter of a prime": {"sample_count": 7},
    "multijitter once": {"sample_count": 1, "jitter": False},
    "orthogonal": {"sample_count": 25},
    "orthogonal in the middle": {"sample_count": 9, "jitter": False},
    "ldsampler": {"sample_count": 64},
}


@pytest.mark.parametrize("name", SPREAD)
def test_pairs_of_all_samplers(mitsuba_llvm: MitsubaWorker, name: str) -> None:
    """Bit for bit, with a seed of the sampler's own, and a number that nobody wants."""
    pixels, seed, own_seed = 40, 11, 3
    kind = name.split()[0]
    plugin = {"type": kind, "seed": own_seed, **SPREAD[name]}
    drawn = [2, 2, 1, 2, 2]
    expected = mitsuba_llvm(
        "sampler_pairs", plugin=plugin, seed=seed, pixels=pixels, drawn=drawn
    )
    samples = len(expected) // pixels
    sampler = {"type": kind, "base_seed": own_seed, "jitter": plugin.get("jitter", True)}
    spread = core.render_selftest.spread_sample
    own = [
        spread(sampler, seed + own_seed, samples, index, drawn)
        for index in range(len(expected))
    ]
    np.testing.assert_array_equal(np.array(own, np.float32), expected)


def test_first_pass_of_a_picture_beyond_32_bits() -> None:
    # 2^20 pixels of 2^13 samples: Mitsuba renders three passes of 2730 samples.
    pixels, samples, per_pass = 1 << 20, 1 << 13, 2730
    for pixel, sample in [(0, 0), (5, 2729), (1_048_575, 17)]:
        state, stream = mi.sample_tea_32(3, pixel * per_pass + sample)
        random = mi.PCG32(1, state, stream)
        expected = [np.float32(random.next_float32()) for _ in range(DIMENSIONS)]
        own = core.render_selftest.sampler_stream(
            3, pixels, samples, pixel, sample, DIMENSIONS
        )
        assert own == expected


def test_later_passes_have_streams_of_their_own() -> None:
    pixels, samples, per_pass = 1 << 20, 1 << 13, 2730

    def stream(sample: int) -> tuple[float, ...]:
        return tuple(
            core.render_selftest.sampler_stream(0, pixels, samples, 4, sample, DIMENSIONS)
        )

    assert len({stream(1), stream(per_pass + 1), stream(2 * per_pass + 1)}) == 3
