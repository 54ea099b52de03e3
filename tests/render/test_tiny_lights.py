"""Lights that glow over an area, in scenes that are so small that areas, or their squares,
are beyond single precision."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from mlrt_compare.bench.offset_scene import Placement, hard_scene

from mlrt_plugin.errors import SceneError
from mlrt_plugin.render import prepare
from mlrt_plugin.scene_arrays import SceneArrays


def room(exponent: int, rectangle: bool) -> SceneArrays:
    """A room of 2^exponent times its size, with a glowing panel that is sampled as a
    rectangle is or as a mesh is."""
    arrays = hard_scene("area", Placement(2.0**exponent), 40, 2)
    (panel,) = arrays.emitters
    return dataclasses.replace(
        arrays, emitters=(dataclasses.replace(panel, rectangle=rectangle),)
    )


@pytest.mark.parametrize("rectangle", [True, False])
@pytest.mark.parametrize("exponent", [-20, -40, -50, -58])
def test_image_is_that_of_the_usual_size(exponent: int, rectangle: bool) -> None:
    """Radiance does not depend on size, and powers of two round nothing."""
    usual, tiny = (
        prepare(room(e, rectangle)).render(shadow_offset="robust", spp=4).image
        for e in (0, exponent)
    )
    assert usual.mean() > 1e-3
    np.testing.assert_allclose(tiny, usual, rtol=2e-5, atol=1e-8)


def test_light_without_a_number_for_its_area_is_refused() -> None:
    arrays = room(0, False)
    vertices = arrays.vertices.copy()
    vertices[-6:] = 1e-25 * np.random.default_rng(1).random((6, 3))
    with pytest.raises(SceneError, match=r"^shape 1 glows and has an area of .*e-5"):
        prepare(dataclasses.replace(arrays, vertices=vertices))
