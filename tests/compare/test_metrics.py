"""Figures against values worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from mlrt_compare.metrics import SizeMismatch, difference, differing_mask


def gray(*rows: list[float]) -> np.ndarray:
    """An image with one channel a pixel."""
    return np.array(rows, np.float64)[..., None]


def test_equal_images_differ_in_nothing() -> None:
    image = np.full((2, 3, 3), 0.25)
    figures = difference(image, image)
    assert (figures.max_abs, figures.rmse, figures.rel_mse) == (0, 0, 0)
    assert (figures.differing, figures.nonfinite, figures.pixels) == (0, 0, 6)


def test_figures_by_hand() -> None:
    # Differences 0, 0.5, -1, 0 against references 1, 1, 2, 0.
    figures = difference(gray([1, 1.5], [1, 0]), gray([1, 1], [2, 0]))
    assert figures.max_abs == 1
    assert figures.rmse == pytest.approx((1.25 / 4) ** 0.5, rel=1e-15)
    assert figures.rel_mse == pytest.approx((0.25 / 1.01 + 1 / 4.01) / 4, rel=1e-15)
    assert figures.differing == 2
    assert figures.share == 0.5


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("step", "differs"), [(0.9e-3, False), (1.1e-3, True)])
def test_threshold_is_one_in_a_thousand_of_the_larger(
    step: float, sign: int, differs: bool
) -> None:
    reference = gray([1, 1])
    assert differing_mask(gray([1 + sign * step, 1]), reference).tolist() == [
        [differs, False]
    ]


def test_one_channel_is_enough() -> None:
    reference = np.ones((1, 2, 3))
    image = reference.copy()
    image[0, 1, 2] = 1.01
    assert differing_mask(image, reference).tolist() == [[False, True]]


@pytest.mark.parametrize("exposure", [1e-6, 1, 1e6])
def test_floor_follows_the_exposure(exposure: float) -> None:
    # The mean of the reference is 0.5: the floor is 5e-7.
    reference = gray([1, 0]) * exposure
    below, above = gray([1, 4e-7]) * exposure, gray([1, 6e-7]) * exposure
    assert not differing_mask(below, reference).any()
    assert differing_mask(above, reference).tolist() == [[False, True]]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["image", "reference", "both"])
def test_what_is_not_finite_is_never_averaged_away(bad: float, where: str) -> None:
    image, reference = np.ones((4, 4, 3)), np.ones((4, 4, 3))
    if where != "reference":
        image[2, 1, 0] = bad
    if where != "image":
        reference[2, 1, 0] = bad
    figures = difference(image, reference)
    assert figures.nonfinite == figures.differing == 1
    assert np.isnan([figures.max_abs, figures.rmse, figures.rel_mse]).all()


def test_sizes_must_agree() -> None:
    with pytest.raises(SizeMismatch, match=r"\(2, 3, 3\) and \(3, 2, 3\)"):
        difference(np.ones((2, 3, 3)), np.ones((3, 2, 3)))


def test_no_pixels_is_an_error() -> None:
    with pytest.raises(ValueError, match="shape"):
        difference(np.ones((0, 3, 3)), np.ones((0, 3, 3)))
