"""Reconstruction filters and film blocks against Mitsuba's rfilter and ImageBlock."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from mitsuba_worker import MitsubaWorker

from mlrt_plugin._dispatch import core

STDDEVS = [0.5, 0.25, 0.9]


def film(**more: Any) -> dict[str, Any]:
    return {"width": 100, "height": 80, "filter": "box"} | more


def gaussian(stddev: float, **more: Any) -> dict[str, Any]:
    return film(
        filter="gaussian",
        filter_stddev=stddev,
        filter_radius=4 * np.float32(stddev),
        **more,
    )


@pytest.mark.parametrize("stddev", STDDEVS)
def test_weights_of_the_gaussian(stddev: float) -> None:
    theirs = mi.load_dict({"type": "gaussian", "stddev": stddev})
    distances = np.linspace(-4.6 * stddev, 4.6 * stddev, 401, dtype=np.float32)
    weights = core.render_selftest.filter_weights(gaussian(stddev), distances.tolist())
    np.testing.assert_allclose(weights, [theirs.eval(x) for x in distances], atol=3e-7)
    assert weights[0] == weights[-1] == 0
    assert weights[200] == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("samples_per_pixel", [1, 4])
@pytest.mark.parametrize("stddev", STDDEVS)
def test_sums_equal_those_of_an_image_block(
    mitsuba_llvm: MitsubaWorker, stddev: float, samples_per_pixel: int
) -> None:
    own_film = gaussian(stddev, crop_x=11, crop_y=7, crop_width=61, crop_height=40)
    random = np.random.default_rng(11)
    corner, extent = np.array([11, 7]), np.array([61, 40])
    count = 500 * samples_per_pixel
    samples = np.column_stack(
        [corner + random.random((count, 2)) * extent, random.random(count)]
    ).astype(np.float32)
    sums, weights = core.render_selftest.accumulate(own_film, samples.tolist())
    expected = mitsuba_llvm(
        "image_block",
        filter={"type": "gaussian", "stddev": stddev},
        size=extent.tolist(),
        offset=corner.tolist(),
        samples=samples.tolist(),
    )
    np.testing.assert_allclose(np.reshape(sums, (40, 61)), expected[..., 0], atol=3e-5)
    np.testing.assert_allclose(np.reshape(weights, (40, 61)), expected[..., 1], atol=3e-5)
    assert np.count_nonzero(expected[..., 1]) > 300
