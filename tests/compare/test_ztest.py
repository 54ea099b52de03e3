"""The z-test against values worked out by hand, its errors of both kinds, and Mitsuba's."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mlrt_compare.ztest import sidak, z_test

SEED = 20_260_809
SHAPE = (24, 32, 3)


def test_p_by_hand() -> None:
    # z = 0.1 sqrt(16 / 0.04) = 2, of which the two-sided p-value is erfc(2 / sqrt 2).
    reference = np.ones(SHAPE)
    image = reference.copy()
    image[3, 4, 1] += 0.1
    test = z_test(image, reference, np.full(SHAPE, 0.04), 16)
    assert test.p_values[3, 4, 1] == pytest.approx(math.erfc(2 / math.sqrt(2)), rel=1e-9)
    assert test.smallest_p == test.p_values[3, 4, 1]
    assert test.p_values[0, 0, 0] == 1


def test_one_channel_is_enough() -> None:
    reference = np.ones((24, 32, 1))
    test = z_test(reference + 0.1, reference, np.full_like(reference, 0.04), 16)
    assert test.smallest_p == pytest.approx(math.erfc(2 / math.sqrt(2)), rel=1e-9)
    expected = 2 * math.sqrt(24 * 32)  # less what counts as rounding
    assert test.mean_z == (pytest.approx(expected, rel=1e-4),)


def test_noise_of_the_reference_counts_if_it_is_told() -> None:
    reference = np.ones(SHAPE)
    image = reference + 0.1
    test = z_test(image, reference, np.full(SHAPE, 0.04), 16, reference_spp=48)
    z = 0.1 / math.sqrt(0.04 * (1 / 16 + 1 / 48))
    assert test.p_values[0, 0, 0] == pytest.approx(math.erfc(z / math.sqrt(2)), rel=1e-9)


def test_floor_of_the_variance_is_that_of_mitsuba() -> None:
    reference = np.ones(SHAPE)
    test = z_test(reference + 0.02, reference, np.zeros(SHAPE), 1)
    expected = math.erfc(0.02 / math.sqrt(1e-4) / math.sqrt(2))
    assert test.p_values[0, 0, 0] == pytest.approx(expected, rel=1e-9)


def test_alpha_is_corrected_for_all_pixels() -> None:
    pixels = SHAPE[0] * SHAPE[1]
    assert sidak(0.01, pixels) == pytest.approx(1 - 0.99 ** (1 / pixels), rel=1e-9)
    assert z_test(np.ones(SHAPE), np.ones(SHAPE), np.ones(SHAPE), 1).alpha == pytest.approx(
        1 - 0.99 ** (1 / pixels), rel=1e-9
    )


@pytest.mark.parametrize(("wrong", "passes"), [(5, True), (6, False)])
def test_a_quarter_per_cent_of_the_channels_may_fail(wrong: int, passes: bool) -> None:
    # 2304 channels of pixels, of which 0.25 % are 5.76.
    image = np.ones(SHAPE)
    image.reshape(-1)[:wrong] += 10
    test = z_test(image, np.ones(SHAPE), np.full(SHAPE, 0.01), 4)
    assert test.pixels_pass is passes


def test_not_finite_never_passes() -> None:
    image = np.ones(SHAPE)
    image[0, 0, 0] = np.nan
    test = z_test(image, np.ones(SHAPE), np.ones(SHAPE), 1)
    assert test.smallest_p == 0 and not test.mean_passes


def test_honest_images_fail_as_rarely_as_promised() -> None:
    """Images of 32 samples of an exponential distribution, as skewed as light is; their
    mean has a gamma distribution."""
    print("seed", SEED)
    generator = np.random.default_rng(SEED)
    reference = generator.uniform(0.2, 1, SHAPE)
    failed_pixels = failed_means = 0
    trials = 300
    for _ in range(trials):
        image = generator.gamma(32, reference / 32)
        test = z_test(image, reference, reference**2, 32)
        failed_pixels += not test.pixels_pass
        failed_means += not test.mean_passes
    assert failed_pixels == 0
    # 3 of 300 are to be expected; with 12 the chance is below 1e-4.
    assert failed_means < 12


def test_small_loss_everywhere_is_found_by_the_mean_only() -> None:
    print("seed", SEED)
    generator = np.random.default_rng(SEED)
    reference = generator.uniform(0.2, 1, (128, 128, 3))
    image = 0.99 * generator.normal(reference, 0.1)
    test = z_test(image, reference, np.full(reference.shape, 0.01), 1)
    assert test.pixels_pass and not test.mean_passes
    assert max(test.mean_z) < 0
    assert "too dark" in test.reasons()[0]


def test_rounding_of_noiseless_images_is_no_loss() -> None:
    reference = np.ones(SHAPE)
    assert z_test(reference * (1 + 5e-7), reference, np.zeros(SHAPE), 1).mean_passes
    assert not z_test(reference * (1 + 5e-6), reference, np.zeros(SHAPE), 1).mean_passes
