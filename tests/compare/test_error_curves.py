"""Factors of curves that are known, and how often intervals hold the truth."""

from __future__ import annotations

import math

import numpy as np
import pytest
from mlrt_compare.error_curves import Runs, equal_error, equal_time, interpolated

SPP = (1, 2, 4, 8, 16, 32)
SEED = 20_260_811


def ideal(
    slower: float = 1.0, noisier: float = 1.0, exponent: float = -1.0, rounds: int = 8
) -> Runs:
    """Ours takes 0.01 s a sample and has an MSE of 0.5 with one; the other is ``slower``
    and ``noisier``."""
    spp = np.array(SPP, np.float64)
    seconds = np.stack([0.01 * spp, slower * 0.01 * spp])
    mse = np.stack([0.5 * spp**exponent, noisier * 0.5 * spp**exponent])
    return Runs(
        SPP, seconds[..., None].repeat(rounds, -1), mse[..., None].repeat(rounds, -1)
    )


def test_a_renderer_three_times_as_slow() -> None:
    runs = ideal(slower=3)
    for index in range(3):  # 3 s a sample up to 12 samples are within our 32
        assert runs.equal_time(index).value == pytest.approx(3, rel=1e-12)
        assert runs.equal_error(index).value == pytest.approx(3, rel=1e-12)
    assert runs.equal_samples_time(5).value == pytest.approx(3)
    assert runs.equal_samples_error(5).value == pytest.approx(1)
    # At 32 samples the other takes 0.96 s, of which our curve ends after 0.32.
    assert runs.equal_time(5).value is None
    assert runs.equal_error(5).value == pytest.approx(3)
    assert runs.over_all(equal_time).value == pytest.approx(3)
    assert runs.over_all(equal_error).value == pytest.approx(3)
    assert runs.efficiency(0, 2).value == pytest.approx(1 / (0.5 / 4 * 0.04))
    assert runs.efficiency(1, 2).value == pytest.approx(1 / (0.5 / 4 * 0.12))


def test_a_renderer_with_half_the_error_for_the_same_time() -> None:
    runs = ideal(noisier=0.5)
    assert runs.equal_time(1).value == pytest.approx(0.5)
    # It has after 2 samples what we have after 4.
    assert runs.equal_error(1).value == pytest.approx(0.5)


@pytest.mark.parametrize("exponent", [-1.0, -0.8])
def test_slope(exponent: float) -> None:
    assert ideal(exponent=exponent).slope(0).value == pytest.approx(exponent, rel=1e-9)


def test_bias_flattens_the_slope() -> None:
    runs = ideal()
    biased = Runs(SPP, runs.seconds, runs.mse + 0.02)
    slope = biased.slope(0)
    assert slope.value is not None and slope.value > -0.9 and not slope.holds(-1)


def test_interpolation_in_logarithms_by_hand() -> None:
    xs, ys = np.array([0.0, 1.0, 3.0]), np.array([0.0, 2.0, 3.0])
    assert interpolated(0.5, xs, ys) == 1
    assert interpolated(2.0, xs, ys) == 2.5
    assert interpolated(2.0, xs[::-1], ys[::-1]) == 2.5
    beyond = math.log(1.25)
    assert interpolated(3 + 0.99 * beyond, xs, ys) == pytest.approx(3 + 0.495 * beyond)
    assert interpolated(3 + 1.01 * beyond, xs, ys) is None
    assert interpolated(-1.01 * beyond, xs, ys) is None


def test_a_converged_reference_without_error_left_has_no_factor() -> None:
    runs = ideal()
    exact = Runs(SPP, runs.seconds, 0 * runs.mse)
    assert exact.equal_time(0).value is None and exact.slope(0).value is None
    assert exact.efficiency(0, 0).value is None


def test_a_line_through_times_of_the_same_tells_no_factor() -> None:
    """Through (1 s, 0.8) and (1 s and a rounding, 0.1) it falls by hundreds of decades
    until 1.2 s."""
    seconds = np.array([[1.0, 1 + 1e-6], [1.2, 1.2]])
    mse = np.array([[0.8, 0.1], [0.8, 0.1]])
    assert equal_time(seconds, mse, 0) is None
    # Ten times as much for what is within the curve is an honest factor.
    assert equal_time(np.array([[1.0, 2.0], [2.0, 4.0]]), mse, 0) == pytest.approx(8)


def test_intervals_hold_the_truth_as_often_as_they_say() -> None:
    print("seed", SEED)
    generator = np.random.default_rng(SEED)
    truth, trials, held = 2.0, 40, 0
    for _ in range(trials):
        runs = ideal(slower=truth, rounds=16)
        seconds = runs.seconds * generator.lognormal(0, 0.1, runs.seconds.shape)
        mse = runs.mse * generator.lognormal(-0.02, 0.2, runs.mse.shape)
        held += Runs(SPP, seconds, mse).equal_samples_time(3).holds(truth)
    # Of a median of 16 runs the bootstrap holds about 93 %; below 32 of 40 has 1 %.
    assert held >= 32
