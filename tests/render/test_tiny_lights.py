"""Lights that glow over an area, in scenes that are so small that areas, or their squares,
are beyond single precision."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import plugin_scenes as parts
import pytest
import texture_scenes
from mlrt_compare.bench.offset_scene import Placement, hard_scene

from mlrt_plugin.errors import SceneError
from mlrt_plugin.render import prepare, render
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


def lit_by(path: Path, light: str) -> Path:
    path.write_text(parts.scene("", light, integrator=texture_scenes.DIRECT_WITHOUT))
    return path


def ball(radius: float, radiance: float) -> str:
    return (
        f'<shape type="sphere"><point name="center" x="0" y="2" z="0"/>'
        f"{parts.number('radius', radius)}"
        f'<emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>'
    )


@pytest.mark.parametrize("offset", ["mitsuba", "robust"])
@pytest.mark.parametrize("radius", [1e-4, 1e-9, 1e-15, 1e-17])
@pytest.mark.filterwarnings("ignore:.*ellipsoid")
def test_tiny_sphere_shines_like_a_point(
    tmp_path: Path, radius: float, offset: str
) -> None:
    """Of the intensity radiance x pi r^2. Mitsuba's own image is black: the cone that such
    a sphere fills closes in single precision."""
    radiance = 10 / (math.pi * radius**2)
    point = (
        '<emitter type="point"><point name="position" x="0" y="2" z="0"/>'
        '<rgb name="intensity" value="10"/></emitter>'
    )
    expected = render(lit_by(tmp_path / "point.xml", point)).image
    path = lit_by(tmp_path / "ball.xml", ball(radius, radiance))
    image = render(path, shading="native", shadow_offset=offset).image
    assert expected.mean() > 0.05
    # Pixels that see the ball itself are one at most.
    differing = np.abs(image - expected).max(axis=-1) > 2e-3 * expected.max()
    assert np.count_nonzero(differing) <= 1


@pytest.mark.filterwarnings("ignore:.*ellipsoid")
@pytest.mark.parametrize(
    ("shape", "area"),
    [("sphere", "1.26e-39"), ("disk", "3.14e-38"), ("cylinder", "6.28e-36")],
)
def test_objects_without_a_number_for_their_area_are_refused(
    tmp_path: Path, shape: str, area: str
) -> None:
    sizes = {
        "sphere": parts.number("radius", 1e-20),
        "disk": '<transform name="to_world"><scale value="1e-19"/></transform>',
        "cylinder": parts.number("radius", 1e-18)
        + '<point name="p1" value="0, 0, 1e-18"/>',
    }
    light = f'<shape type="{shape}">{sizes[shape]}<emitter type="area"/></shape>'
    path = lit_by(tmp_path / "scene.xml", light)
    with pytest.raises(
        SceneError, match=f"shape '{shape}' .*glows and has an area of {area}"
    ):
        prepare(path, shading="native")


def test_mitsubas_shading_tells_of_lights_that_it_does_not_find(tmp_path: Path) -> None:
    for radius, told in ((1e-15, True), (1e-4, True), (0.1, False)):
        prepared = prepare(lit_by(tmp_path / "s.xml", ball(radius, 1)), shading="mitsuba")
        assert any("find no light of it" in text for text in prepared.warnings) == told
