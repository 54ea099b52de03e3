"""Pictures: what is drawn where, and that marks are where pixels differ."""

from __future__ import annotations

import numpy as np
from mlrt_compare.report import (
    LABEL_HEIGHT,
    MARK,
    marked,
    side_by_side,
    signed_difference,
    to_srgb8,
)


def test_srgb_of_known_values() -> None:
    # Linear 0.0031308 is where the curve leaves its straight part; 0.5 is code 188
    # (187.516).
    image = np.array([[[0, 1, 2], [0.5, 0.0031308, -1], [np.nan, 0, 0]]])
    assert to_srgb8(image).tolist() == [[[0, 255, 255], [188, 10, 0], [255, 0, 255]]]


def test_difference_is_black_where_equal_and_tells_the_brighter_side() -> None:
    reference = np.full((1, 3, 3), 0.5)
    image = reference + np.array([0, 0.02, -0.02])[None, :, None]
    equal, brighter, darker = signed_difference(image, reference)[0].astype(int)
    assert equal.tolist() == [0, 0, 0]
    assert brighter[0] > brighter[2] and darker[2] > darker[0]


def test_every_differing_pixel_is_marked_and_nothing_far_from_one() -> None:
    reference = np.full((20, 30, 3), 0.5)
    image = reference.copy()
    image[0, 0] = image[10, 17] = 1
    red = (marked(image, reference) == MARK).all(axis=-1)
    assert red[0:2, 0:2].all() and red[9:12, 16:19].all()
    assert np.count_nonzero(red) == 4 + 9


def test_tiles_stand_in_a_row_enlarged_alike() -> None:
    image = np.full((40, 100, 3), 0.25)
    picture = side_by_side(image, image, ("left", "right"))
    factor = 3  # the least whole number that makes 100 pixels at least 256
    assert picture.shape == (40 * factor + LABEL_HEIGHT, 4 * 100 * factor, 3)
    tiles = np.split(picture[LABEL_HEIGHT:], 4, axis=1)
    assert np.abs(tiles[0].astype(int) - 137).max() <= 1 and (tiles[1] == tiles[0]).all()
    assert (tiles[2] == 0).all()
    assert not (tiles[3] == MARK).all(axis=-1).any()
    labels = np.split(picture[:LABEL_HEIGHT], 4, axis=1)
    assert all((label < 128).any() for label in labels), "every tile has a label"
