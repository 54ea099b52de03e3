"""Reconstruction filters and film blocks against Mitsuba's rfilter and ImageBlock."""

from __future__ import annotations

import math
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


OTHERS = [
    {"type": "tent"},
    {"type": "tent", "radius": 1.7},
    {"type": "mitchell"},
    {"type": "mitchell", "B": 0.2, "C": 0.7},
    {"type": "catmullrom"},
    {"type": "lanczos"},
    {"type": "lanczos", "lobes": 2},
]


def film_with(rfilter: dict[str, Any], **more: Any) -> dict[str, Any]:
    if rfilter["type"] == "gaussian":
        return gaussian(rfilter["stddev"], **more)
    radius = mi.load_dict(rfilter).radius()
    if rfilter["type"] == "mitchell":
        more.update({f"filter_{k.lower()}": v for k, v in rfilter.items() if k in "BC"})
    return film(filter=rfilter["type"], filter_radius=radius, **more)


@pytest.mark.parametrize("rfilter", OTHERS, ids=str)
def test_weights_of_other_filters(rfilter: dict[str, Any]) -> None:
    theirs = mi.load_dict(rfilter)
    radius = float(theirs.radius())
    distances = np.linspace(-radius, radius, 401, dtype=np.float32)
    weights = core.render_selftest.filter_weights(film_with(rfilter), distances.tolist())
    # Their cubics are summed up in single precision, in which terms cancel.
    np.testing.assert_allclose(weights, [theirs.eval(x) for x in distances], atol=2e-6)
    beyond = [-radius - 0.01, radius + 0.01]
    assert not np.any(core.render_selftest.filter_weights(film_with(rfilter), beyond))


@pytest.mark.parametrize("samples_per_pixel", [1, 4])
@pytest.mark.parametrize(
    "rfilter", [*({"type": "gaussian", "stddev": s} for s in STDDEVS), *OTHERS], ids=str
)
def test_sums_equal_those_of_an_image_block(
    mitsuba_llvm: MitsubaWorker, rfilter: dict[str, Any], samples_per_pixel: int
) -> None:
    crop = {"crop_x": 11, "crop_y": 7, "crop_width": 61, "crop_height": 40}
    own_film = film_with(rfilter, **crop)
    random = np.random.default_rng(11)
    corner, extent = np.array([11, 7]), np.array([61, 40])
    count = 500 * samples_per_pixel
    samples = np.column_stack(
        [corner + random.random((count, 2)) * extent, random.random(count)]
    ).astype(np.float32)
    sums, weights = core.render_selftest.accumulate(own_film, samples.tolist())
    expected = mitsuba_llvm(
        "image_block",
        filter=rfilter,
        size=extent.tolist(),
        offset=corner.tolist(),
        samples=samples.tolist(),
    )
    np.testing.assert_allclose(np.reshape(sums, (40, 61)), expected[..., 0], atol=3e-5)
    np.testing.assert_allclose(np.reshape(weights, (40, 61)), expected[..., 1], atol=3e-5)
    assert np.count_nonzero(expected[..., 1]) > 300


@pytest.mark.parametrize("rays_per_group", [16, 1024])
@pytest.mark.parametrize("samples_per_pixel", [1, 4, 37])
def test_pixels_of_a_box_equal_those_of_an_image_block(
    mitsuba_llvm: MitsubaWorker, samples_per_pixel: int, rays_per_group: int
) -> None:
    """Also where the samples of a pixel come in several groups."""
    width, height = 61, 40
    crop = {"crop_x": 11, "crop_y": 7, "crop_width": width, "crop_height": height}
    values = np.random.default_rng(13).random(
        (height, width, samples_per_pixel), np.float32
    )
    image = core.render_selftest.picture(
        film(**crop), samples_per_pixel, rays_per_group, values.ravel().tolist()
    )
    rows, columns, _ = np.indices(values.shape)
    # Mitsuba adds at the pixel, not at the position.
    samples = np.stack([columns + 11, rows + 7, values], axis=-1).reshape(-1, 3)
    expected = mitsuba_llvm(
        "image_block",
        filter={"type": "box"},
        size=[width, height],
        offset=[11, 7],
        samples=samples.tolist(),
    )
    np.testing.assert_array_equal(expected[..., 1], samples_per_pixel)
    for colour in np.moveaxis(np.reshape(image, (height, width, 3)), -1, 0):
        np.testing.assert_allclose(colour, expected[..., 0] / samples_per_pixel, rtol=3e-6)


def test_sums_of_many_samples_are_compensated() -> None:
    """Against sums without rounding; plain ones would be off by 1e-3."""
    random = np.random.default_rng(17)
    count = 300_000
    own_film = film_with({"type": "gaussian", "stddev": 0.5}, crop_width=2, crop_height=1)
    samples = np.column_stack(
        [random.random((count, 2)) * (2, 1), np.full(count, 0.37)]
    ).astype(np.float32)
    sums, weights = core.render_selftest.accumulate(own_film, samples.tolist())
    for column in range(2):
        distances = samples[:, :2] - np.array([column + 0.5, 0.5], np.float32)
        each = [
            np.array(core.render_selftest.filter_weights(own_film, d.tolist()), np.float64)
            for d in distances.T
        ]
        exact = math.fsum(each[0] * each[1])
        assert weights[column] == pytest.approx(exact, rel=2e-6)
        assert sums[column] == pytest.approx(0.37 * exact, rel=2e-6)


def test_pixels_of_many_samples_are_compensated() -> None:
    spp = 3_000_000
    for rays_per_group in (4096, 1000):
        image = core.render_selftest.picture(
            film(crop_width=1, crop_height=1), spp, rays_per_group, [0.37] * spp
        )
        assert image[0] == pytest.approx(np.float32(0.37), rel=1e-6)
