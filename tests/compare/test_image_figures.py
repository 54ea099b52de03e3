"""Figures of images against values worked out by hand."""

from __future__ import annotations

import math
from pathlib import Path

import exr_images
import numpy as np
import pytest
from mlrt_compare.exr_files import ExrImage
from mlrt_compare.image_figures import image_figures
from mlrt_compare.perceptual import displayed, flip, psnr, ssim, white

SEED = 20_260_807


def exr(**channels: np.ndarray) -> ExrImage:
    planes = {name: np.asarray(plane, np.float64) for name, plane in channels.items()}
    return ExrImage(Path("image.exr"), planes, (0, 0))


def gray(values: list[list[float]]) -> dict[str, np.ndarray]:
    return dict.fromkeys("RGB", np.array(values))


def test_linear_metrics_by_hand() -> None:
    # Differences 0, 0.5, -1, 0 against references 1, 1, 2, 0.
    figures = image_figures(
        exr(**gray([[1, 1.5], [1, 0]])), exr(**gray([[1, 1], [2, 0]])), "RGB"
    )
    metrics = figures.metrics
    assert metrics["abs"] == 1
    assert metrics["mean_abs"] == pytest.approx(1.5 / 4, rel=1e-15)
    assert metrics["rmse"] == pytest.approx(math.sqrt(1.25 / 4), rel=1e-15)
    assert metrics["relmse"] == pytest.approx((0.25 / 1.01 + 1 / 4.01) / 4, rel=1e-15)
    assert metrics["smape"] == pytest.approx((1 / 2.5 + 2 / 3) / 4, rel=1e-15)
    assert metrics["energy"] == pytest.approx(3.5 / 4 - 1, rel=1e-15)
    assert figures.share_beyond(0.49) == 0.5 and figures.share_beyond(0.5) == 0.25
    assert figures.deviation.tolist() == [[0, 0.5], [1, 0]]


def test_channels_are_told_apart() -> None:
    reference = {"R": np.ones((2, 2)), "depth.T": np.full((2, 2), 5.0)}
    image = {**reference, "depth.T": np.array([[5.0, 5.0], [5.0, 9.0]])}
    red, depth = image_figures(exr(**image), exr(**reference), ("R", "depth.T")).channels
    assert (red.max_abs, red.rmse) == (0, 0)
    assert (depth.max_abs, depth.rmse, depth.mean_image) == (4, 2, 6)


def test_no_colour_no_metrics_of_it() -> None:
    figures = image_figures(
        exr(depth=np.ones((3, 3))), exr(depth=np.ones((3, 3))), ["depth"]
    )
    assert not figures.colour and set(figures.metrics.values()) == {None}


def test_luminance_alone_is_a_colour() -> None:
    reference = exr_images.picture(SEED)[..., 0]
    figures = image_figures(exr(Y=1.1 * reference), exr(Y=reference), ["Y"])
    assert figures.colour == ("Y",)
    assert figures.metrics["energy"] == pytest.approx(0.1, rel=1e-6)
    assert None not in figures.metrics.values()


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_counted_and_spoils_every_metric(bad: float) -> None:
    reference = np.full((16, 16), 0.5)
    image = reference.copy()
    image[3, 4] = bad
    figures = image_figures(
        exr(R=reference, G=image, B=reference),
        exr(**dict.fromkeys("RGB", reference)),
        "RGB",
    )
    green = figures.channels[1]
    assert (green.nan, green.infinite) == ((1, 0) if np.isnan(bad) else (0, 1))
    assert figures.nonfinite == 1 and figures.share_beyond(1e30) == 1 / 256
    told = [value for value in figures.metrics.values() if value is not None]
    assert len(told) == len(figures.metrics) and all(math.isnan(value) for value in told)


def test_white_is_the_99th_percentile_and_follows_the_exposure() -> None:
    image = np.linspace(0, 1, 101)[None, :, None].repeat(3, axis=-1)
    assert white(image) == pytest.approx(0.99)
    assert white(1e6 * image) == pytest.approx(0.99e6)
    assert white(np.zeros((2, 2, 3))) == 1
    # Half of white in linear light is code 188 (187.516) of 255 in sRGB.
    shown = displayed(np.full((1, 1, 3), 0.495), image)
    assert 255 * shown[0, 0, 0] == pytest.approx(187.516, abs=1e-3)


def test_psnr_by_hand() -> None:
    reference = np.full((4, 4, 3), 1.0)
    # Displayed values of 1 and of 0.5, exposed for 1: their difference everywhere.
    step = 1 - (1.055 * 0.5 ** (1 / 2.4) - 0.055)
    expected = -20 * math.log10(step)
    assert psnr(0.5 * reference, reference) == pytest.approx(expected, rel=1e-12)
    assert psnr(reference, reference) == math.inf


def test_ssim_of_constant_images_by_hand() -> None:
    # Without variance SSIM is (2 a b + c1) / (a^2 + b^2 + c1), c1 = 0.01^2.
    reference = np.full((16, 16, 3), 1.0)
    a = 1.055 * 0.25 ** (1 / 2.4) - 0.055
    expected = (2 * a + 1e-4) / (a * a + 1 + 1e-4)
    assert ssim(0.25 * reference, reference) == pytest.approx(expected, rel=1e-9)
    assert ssim(reference[:10], reference[:10]) is None


def test_flip_is_0_for_equal_images_and_found_where_they_differ() -> None:
    reference = exr_images.picture(SEED)
    same = flip(reference, reference)
    assert same is not None and same.mean == 0 and not same.error.any()
    image = reference.copy()
    image[10:14, 20:24] *= 3
    found = flip(image, reference)
    assert found is not None
    row, column = np.unravel_index(found.error.argmax(), found.error.shape)
    assert 9 <= row <= 14 and 19 <= column <= 24
    assert found.mean == pytest.approx(float(found.error.mean()), rel=1e-4)
    assert found.error[40:, 50:].max() == 0


@pytest.mark.parametrize("exposure", [2.0**-80, 1.0, 2.0**80])
def test_flip_follows_the_exposure(exposure: float) -> None:
    reference = exr_images.picture(SEED).astype(np.float64)
    image = reference * 1.1
    usual, scaled = flip(image, reference), flip(image * exposure, reference * exposure)
    assert usual is not None and scaled is not None
    assert scaled.mean == pytest.approx(usual.mean, rel=1e-6)
    shift = math.log2(exposure)
    assert scaled.exposures[0] == pytest.approx(usual.exposures[0] - shift, abs=1e-3)


def test_flip_of_black_references_cannot_be_told() -> None:
    assert flip(np.ones((8, 8, 3)), np.zeros((8, 8, 3))) is None
