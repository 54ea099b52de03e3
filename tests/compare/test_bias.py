"""Bias is found where there is some, and only there; references know their noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mlrt_compare.batch_reference import TILE, batch_reference, tile_means
from mlrt_compare.bias import ROUNDING, bias_test, welch
from mlrt_compare.reference_cache import ReferenceCache
from mlrt_compare.seeds import spread_seeds
from scipy.stats import ttest_ind

SEED = 20_260_812
BATCHES = 32
TILES = (9, 12)


def renders(generator: np.random.Generator, scale: float = 1.0) -> np.ndarray:
    """Means of tiles of independent renders with a tenth of noise."""
    return scale * generator.normal(1, 0.1, (BATCHES, *TILES))


def test_p_values_are_scipys() -> None:
    generator = np.random.default_rng(SEED)
    first, second = renders(generator), 1.5 * renders(generator)
    p, noisy = welch(first, second, np.full(TILES, 1e-6))
    expected = ttest_ind(first, second, axis=0, equal_var=False).pvalue
    assert noisy.all()
    np.testing.assert_allclose(p, expected, rtol=1e-9)


def test_without_bias_it_passes_as_often_as_promised() -> None:
    print("seed", SEED)
    generator = np.random.default_rng(SEED)
    trials = 300
    failed = sum(
        not bias_test(renders(generator), renders(generator)).passed for _ in range(trials)
    )
    # 3 of 300 are to be expected; with 12 the chance is below 1e-4.
    assert failed < 12


def test_a_small_bias_everywhere_is_found_by_the_means() -> None:
    generator = np.random.default_rng(SEED)
    test = bias_test(renders(generator, 0.99), renders(generator))
    assert not test.passed and test.mean_p < 1e-3
    assert test.interval[0] < -0.01 < test.interval[1] and test.interval[1] < 0


def test_a_bias_of_one_tile_is_found_there() -> None:
    generator = np.random.default_rng(SEED)
    first = renders(generator)
    first[:, 3, 4] *= 1.2
    test = bias_test(first, renders(generator))
    assert test.smallest_p < 1e-3 and not test.passed
    assert sum(test.histogram) == test.tiles == TILES[0] * TILES[1]


def test_more_noise_of_one_tile_is_found_there() -> None:
    generator = np.random.default_rng(SEED)
    first, second = renders(generator), renders(generator)
    first[:, 3, 4] = 1 + 4 * (first[:, 3, 4] - 1)
    test = bias_test(first, second)
    assert test.spread_smallest_p < 1e-3 and not test.passed
    assert test.smallest_p > 0.01, "the means are the same"
    # One tile of 108 has 16 times the variance.
    assert test.variance_ratio == pytest.approx((107 + 16) / 108, rel=0.1)


def quiet_renders(generator: np.random.Generator, noise: float) -> np.ndarray:
    """As `renders`, but that the means of the first row are 1 and their batches have a
    noise, in units of rounding, that becomes that of the means."""
    tiles = renders(generator)
    deviation = noise * ROUNDING * (BATCHES / 2) ** 0.5
    tiles[:, 0] = generator.normal(1, deviation, (BATCHES, TILES[1]))
    return tiles


def test_tiles_without_noise() -> None:
    same = np.ones((BATCHES, *TILES))
    test = bias_test(same, same)
    assert test.passed and test.quiet_tiles == TILES[0] * TILES[1] and test.tiles == 0
    other = same.copy()
    other[:, 0, 0] = 1.01
    test = bias_test(other, same)
    assert test.differing_quiet == 1 and not test.passed
    assert any("1 of 108 tiles with less noise" in reason for reason in test.reasons())


def test_less_noise_than_rounding_passes_as_often_as_promised() -> None:
    """Where noise and rounding are alike, a difference of means is above rounding every
    few tiles, and says nothing."""
    print("seed", SEED)
    generator = np.random.default_rng(SEED)
    trials, failed, above = 200, 0, 0
    for _ in range(trials):
        first, second = (quiet_renders(generator, 0.8) for _ in range(2))
        test = bias_test(first, second)
        assert test.quiet_tiles >= TILES[1] / 2
        failed += test.differing_quiet > 0
        difference = np.abs(np.mean(first - second, axis=0))[0]
        above += np.count_nonzero(difference > ROUNDING)
    assert above > trials, "the case that this is about"
    # Two in a thousand may fail; with 4 of 200 the chance is below 1e-3.
    assert failed < 4


@pytest.mark.parametrize("noise", [0.0, 0.3, 0.8])
@pytest.mark.parametrize(
    "bias",
    [
        0.99,  # of energy
        0.5,  # one light of two
        1 + 8 * ROUNDING,
    ],
)
def test_a_bias_of_a_quiet_tile_is_found(noise: float, bias: float) -> None:
    generator = np.random.default_rng(SEED)
    first, second = (quiet_renders(generator, noise) for _ in range(2))
    assert bias_test(first, second).differing_quiet == 0
    first[:, 0, 3] *= bias
    test = bias_test(first, second)
    assert test.differing_quiet == 1 and not test.passed


def test_a_rounding_of_a_bright_tile_is_none() -> None:
    """A lamp in view, as single precision holds it and as its next number."""
    dim = np.full((BATCHES, *TILES), 0.01)
    first, second = dim.copy(), dim.copy()
    first[:, 2, 2] = np.float32(40)
    second[:, 2, 2] = np.nextafter(np.float32(40), np.float32(41))
    assert abs(first[0, 2, 2] - second[0, 2, 2]) > ROUNDING * second[0].mean()
    assert bias_test(first, second).passed
    second[:, 2, 2] *= 1 + 4 * ROUNDING
    assert not bias_test(first, second).passed


def test_tile_means_by_hand() -> None:
    image = np.zeros((TILE + 2, 2 * TILE, 3))
    image[TILE:, TILE:] = 3.0  # the lower tile is 2 x 16 pixels
    image[0, 0] = [1, 2, 3]
    means = tile_means(image)
    assert means.shape == (2, 2)
    assert means == pytest.approx(np.array([[2 / TILE**2, 0], [0, 3]]))


def test_seeds_are_spread_and_come_out_again() -> None:
    first, second = spread_seeds(2**32, 64), spread_seeds(2**32 + 1, 64)
    assert first == spread_seeds(2**32, 64) and first[:8] == spread_seeds(2**32, 8)
    assert len({*first, *second}) == 128
    assert all(0 <= seed < 2**32 for seed in first)
    assert min(np.diff(sorted(first))) > 1000


class Noisy:
    """A renderer whose images are noise about 1, of a variance of 1 a sample."""

    name, load, build, warnings = "noisy", 0.0, 0.0, ()

    def __init__(self) -> None:
        self.frames = 0
        self.image = np.zeros((1, 1, 3), np.float32)

    def frame(self, *, spp: int | None = None, seed: int | None = None) -> float:
        generator = np.random.default_rng(seed)
        self.image = generator.normal(1, (spp or 1) ** -0.5, (20, 24, 3)).astype(np.float32)
        self.frames += 1
        return 0.0


def test_reference_tells_its_own_noise_and_is_kept(tmp_path: Path) -> None:
    renderer, cache = Noisy(), ReferenceCache(tmp_path)
    options = {"batches": 16, "spp": 4, "seed": SEED}
    reference = batch_reference(renderer, ("key",), cache, **options)
    # 64 samples of variance 1; of 1440 estimates from 16 batches.
    assert reference.mse == pytest.approx(1 / 64, rel=0.05)
    assert np.mean((reference.mean - 1) ** 2) == pytest.approx(1 / 64, rel=0.15)
    assert (reference.spp, reference.tiles.shape) == (64, (16, 2, 2))
    assert renderer.frames == 16
    again = batch_reference(renderer, ("key",), cache, **options)
    assert renderer.frames == 16
    np.testing.assert_array_equal(again.mean, reference.mean)
    batch_reference(renderer, ("another key",), cache, **options)
    assert renderer.frames == 32
    for path in tmp_path.iterdir():
        path.write_bytes(path.read_bytes()[:100])
    batch_reference(renderer, ("key",), cache, **options)
    assert renderer.frames == 48, "a damaged file is rendered anew"
