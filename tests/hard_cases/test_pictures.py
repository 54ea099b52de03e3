"""Hard cases of light and shadow, by pictures of small scenes, which are the same by every
traversal, from the root and from entry points, through finished and growing trees."""

from __future__ import annotations

import math
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import pytest
import render_scenes
from hard_cases.case import covers
from hard_cases.running import WAYS

import mlrt_plugin
from mlrt_plugin.render import prepare

pytestmark = pytest.mark.usefixtures("scalar_variant")

Picture = npt.NDArray[np.float32]
SceneDict = dict[str, Any]
OFFSETS = ("mitsuba", "robust")
EAGER = ("exact", "fast")
each_offset = pytest.mark.parametrize("offset", OFFSETS)


def render(scene: SceneDict, offset: str = "mitsuba", **options: Any) -> Any:
    """A picture, which every way of tracing and every builder must give."""
    result = mlrt_plugin.render(scene, spp=1, shadow_offset=offset, **options)
    prepared = {builder: prepare(scene, builder=builder) for builder in EAGER}
    for name, way in WAYS.items():
        # A lazy tree grows as it is traced.
        for builder, other in {**prepared, "lazy": prepare(scene, builder="lazy")}.items():
            picture = other.render(spp=1, shadow_offset=offset, **way).image
            np.testing.assert_array_equal(picture, result.image, f"{name}, {builder}")
    return result


def grey(scene: SceneDict, offset: str = "mitsuba", **options: Any) -> Picture:
    """The red channel of a picture, (H, W)."""
    image: Picture = render(scene, offset, **options).image[:, :, 0]
    return image


def scene_of(
    light: tuple[float, float, float],
    *,
    size: float = 1.0,
    eye: tuple[float, float, float] = (0, -4, 3),
    **shapes: SceneDict,
) -> SceneDict:
    """Shapes under a point light, all of it scaled by `size`, in 64 x 64 pixels."""
    scaled = render_scenes.scale(size, size, size)
    up = [0, 0, 1]
    view = mi.ScalarTransform4f().look_at(
        origin=[size * x for x in eye], target=[0, 0, 0], up=up
    )
    placed = {
        name: {**shape, "to_world": scaled @ shape["to_world"]}
        for name, shape in shapes.items()
    }
    return {
        "type": "scene",
        "integrator": {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0},
        **placed,
        "light": {
            "type": "point",
            "position": [size * x for x in light],
            "intensity": render_scenes.rgb(*(3 * [size * size * math.pi])),
        },
        "sensor": {
            "type": "perspective",
            "fov": 45,
            "near_clip": 1e-6 * size,
            "far_clip": 1e3 * size,
            "to_world": view,
            "film": render_scenes.film(64, 64),
            "sampler": {"type": "independent"},
        },
    }


def rectangle(half: float, *steps: Any) -> SceneDict:
    """A square in the plane z = 0 that faces upwards, two-sided, of reflectance 1/2."""
    return {
        "type": "rectangle",
        "to_world": render_scenes.transform(*steps, render_scenes.scale(half, half, 1)),
        "bsdf": {"type": "twosided", "bsdf": render_scenes.diffuse(0.5, 0.5, 0.5)},
    }


def cube(half: float, *steps: Any) -> SceneDict:
    return {
        "type": "cube",
        "to_world": render_scenes.transform(*steps, render_scenes.scale(half, half, half)),
        "bsdf": {"type": "twosided", "bsdf": render_scenes.diffuse(0.5, 0.5, 0.5)},
    }


@covers(13)
@pytest.mark.parametrize("size", [1e-6, 1e-3, 1e6])
def test_a_cast_shadow_at_any_scale(size: float) -> None:
    """Coordinates of 10^-6 units are far below the constants in usual offsets of shadow
    rays, and rounded anew, as 10^-6 is no power of two."""
    shapes = {
        "floor": rectangle(2),
        "box": cube(0.4, render_scenes.translate(0, 0, 0.8)),
    }
    light = (0.3, 0.2, 3.0)
    expected = render(scene_of(light, **shapes), "robust", aovs=["prim"])
    found = render(scene_of(light, size=size, **shapes), "robust", aovs=["prim"])
    before, after = expected.image[:, :, 0], found.image[:, :, 0]
    # Pixels whose ray passes an edge by within a rounding see another face.
    same = expected.aovs["prim"] == found.aovs["prim"]
    assert same.mean() > 0.99
    shadow = (before == 0) & (expected.aovs["prim"] >= 0)
    assert shadow.sum() > 50
    # At borders of the shadow a rounding decides: at most a few pixels.
    assert np.count_nonzero((before == 0) != (after == 0)) <= 2
    lit = same & (before > 0) & (after > 0)
    np.testing.assert_allclose(after[lit], before[lit], rtol=1e-5)


@covers(33)
@each_offset
def test_light_on_a_triangle(offset: str) -> None:
    """Shadow rays end on the triangle, or start there, at a distance that may round either
    way; its own plane must not hide the light from the ceiling."""
    ceiling = rectangle(2, render_scenes.translate(0, 0, 1.5))
    floor = rectangle(0.5, render_scenes.translate(0, 0, -0.5))
    eye = (0, -3, -2)
    free = grey(scene_of((0.1, 0.05, -0.5), eye=eye, ceiling=ceiling), offset)
    found = render(
        scene_of((0.1, 0.05, -0.5), eye=eye, ceiling=ceiling, floor=floor),
        offset,
        aovs=["prim"],
    )
    # Faces 0 and 1 are the ceiling's.
    seen = (found.aovs["prim"] >= 0) & (found.aovs["prim"] < 2)
    assert seen.sum() > 500
    assert (free[seen] > 0).all()
    np.testing.assert_array_equal(found.image[:, :, 0][seen], free[seen])


@covers(33)
@each_offset
def test_light_inside_a_closed_mesh(offset: str) -> None:
    """Every shadow ray from outside meets the mesh, those at edges and vertices too."""
    shapes = {
        "floor": rectangle(3, render_scenes.translate(0, 0, -0.6)),
        "box": cube(0.5, render_scenes.rotate((1, 1, 0), 35)),
    }
    lit = grey(scene_of((0, 0, 0), floor=shapes["floor"]), offset)
    assert (lit > 0).mean() > 0.5
    assert not grey(scene_of((0, 0, 0), **shapes), offset).any()


@covers(33)
@each_offset
def test_light_at_the_camera(offset: str) -> None:
    """Shadow rays go back along the rays that were traced: no surface that is seen lies in
    shadow, at edges neither."""
    eye = (0.0, -4.0, 3.0)
    shapes = {
        "floor": rectangle(6),
        "box": cube(0.5, render_scenes.translate(0, 0, 0.7)),
    }
    found = render(scene_of(eye, eye=eye, **shapes), offset, aovs=["depth", "prim"])
    image, prim = found.image[:, :, 0], found.aovs["prim"]
    seen = prim >= 0
    assert seen.mean() > 0.9
    assert (image[seen] > 0).all()
    # On the floor: 1 / 2 of pi / distance^2 / pi, times the cosine 3 / distance.
    floor = seen & (prim < 2)
    assert floor.sum() > 1000
    expected = 0.5 * eye[2] / found.aovs["depth"][floor].astype(np.float64) ** 3
    np.testing.assert_allclose(image[floor], expected, rtol=1e-5)


@covers(34)
@each_offset
def test_light_in_the_plane_of_the_receiver(offset: str) -> None:
    """The cosine is exactly zero, or a rounding of either sign, and the shadow ray runs in
    the surface."""
    scene = scene_of((1.5, 0.25, 0), floor=rectangle(1))
    found = render(scene, offset, aovs=["prim"])
    assert (found.aovs["prim"] >= 0).sum() > 500
    assert not found.image.any()
    assert found.counters["shadow_rays"] == 0
    # The light is there: something that stands on the floor has it.
    wall = rectangle(
        0.5, render_scenes.translate(0, 0.5, 0.5), render_scenes.rotate((1, 0, 0), 90)
    )
    assert grey(scene_of((1.5, 0.25, 0), floor=rectangle(1), wall=wall), offset).any()


@covers(35)
@each_offset
def test_camera_in_a_closed_room(offset: str) -> None:
    """Walls stop whole tiles, so that all that stands behind is left out, which must not be
    done with what stands before."""
    room = {
        "room": cube(2, render_scenes.translate(0, 0, 1)),
        "box": cube(0.3, render_scenes.translate(0.2, 0.5, 0.7)),
        "small": cube(0.05, render_scenes.translate(0.15, -1, 0.8)),
        "far": cube(0.5, render_scenes.translate(0, 9, 0)),
    }
    scene = scene_of((0.5, -0.5, 2.5), eye=(0.1, -1.7, 1.4), **room)
    pictures = [
        render(scene, offset, aovs=["prim"], covering_triangles=covering, **ways)
        for covering in (True, False)
        for ways in ({}, {"traversal": "packet", "initial_tile": 16, "minimum_tile": 4})
    ]
    for picture in pictures:
        np.testing.assert_array_equal(picture.image, pictures[0].image)
        assert (picture.aovs["prim"] >= 0).all()
        # Twelve faces each: what is behind the walls is not seen.
        assert (picture.aovs["prim"] < 36).all()
    seen = np.unique(pictures[0].aovs["prim"] // 12)
    assert seen.tolist() == [0, 1, 2]


@covers(37)
@each_offset
def test_shadow_rays_end_short_of_an_area_light(offset: str) -> None:
    """The light is itself a surface at the end of each shadow ray, and hides itself where
    the end is rounded up."""
    scene = scene_of((0, 0, 50), floor=rectangle(1))
    scene["light"] = {
        "type": "rectangle",
        "to_world": render_scenes.transform(
            render_scenes.translate(0, 0, 1), render_scenes.rotate((1, 0, 0), 180)
        ),
        "emitter": {"type": "area", "radiance": render_scenes.rgb(1, 1, 1)},
        "bsdf": render_scenes.diffuse(0.5, 0.5, 0.5),
    }
    scene["sensor"]["to_world"] = render_scenes.transform(
        mi.ScalarTransform4f().look_at(origin=[0, -4, 0.6], target=[0, 0, 0], up=[0, 0, 1])
    )
    found = render(scene, offset, aovs=["prim"])
    # The floor is the first shape, so its faces are 0 and 1.
    floor = (found.aovs["prim"] >= 0) & (found.aovs["prim"] < 2)
    assert floor.sum() > 100
    assert (found.image[:, :, 0][floor] > 0).all()
