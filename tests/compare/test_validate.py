"""The verdict must be able to fail: images that are wrong in one way each."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from mlrt_compare.validate import judge

SEED = 20_100_707


def picture() -> np.ndarray:
    """64 x 48 pixels of smooth colour with an edge and some noise, all of it positive."""
    y, x = np.mgrid[0:48, 0:64] / 64
    image = np.stack([0.2 + 0.5 * x, 0.3 + 0.4 * y, 0.4 + 0.2 * x * y], axis=-1)
    image[:, 32:] *= 0.5
    noise = np.random.default_rng(SEED).uniform(0.98, 1.02, image.shape)
    return (image * noise).astype(np.float32)


def with_nan(image: np.ndarray) -> np.ndarray:
    image[10, 10, 1] = np.nan
    return image


WRONG: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "shifted by a pixel": lambda image: np.roll(image, 1, axis=1),
    "one per cent too bright": lambda image: image * 1.01,
    "red and blue exchanged": lambda image: image[..., ::-1],
    "upside down": lambda image: image[::-1],
    "one nan": with_nan,
    "black": np.zeros_like,
    "a row missing": lambda image: image[:-1],
    "a channel missing": lambda image: image[..., :2],
}


def test_equal_images_pass() -> None:
    verdict = judge(picture(), picture())
    assert verdict.passed
    assert str(verdict) == "PASS"


@pytest.mark.parametrize("how", WRONG)
def test_wrong_images_fail(how: str) -> None:
    verdict = judge(WRONG[how](picture()), picture())
    assert not verdict.passed
    assert str(verdict).startswith("FAIL: ")


def test_two_black_images_fail() -> None:
    black = np.zeros((8, 8, 3))
    assert not judge(black, black).passed


def test_nan_in_both_images_fails() -> None:
    assert not judge(with_nan(picture()), with_nan(picture())).passed


@pytest.mark.parametrize(("differing", "passes"), [(3, True), (4, False)])
def test_at_most_a_thousandth_of_the_pixels_may_differ(
    differing: int, passes: bool
) -> None:
    reference = picture()  # 3072 pixels
    image = reference.copy()
    image[0, :differing] *= 2
    assert judge(image, reference).passed is passes
