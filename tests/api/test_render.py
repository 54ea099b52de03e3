"""render(): arguments, results, and the image against Mitsuba's."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
import repository
import scene_files

import mlrt_plugin
from mlrt_plugin import MlrtError, MlrtWarning, SceneError, UnsupportedFeature, render

SceneFile = Callable[..., Path]

BLOCK = """<shape type="cube" id="block"><transform name="to_world">
    <scale value="0.4"/><rotate x="1" y="1" angle="40"/><translate z="0.6"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse">
        <rgb name="reflectance" value="0.2, 0.4, 0.8"/></bsdf></bsdf></shape>"""
LIT = {"shapes": scene_files.FLOOR + BLOCK}
GLOWING = """<shape type="rectangle" id="panel"><emitter type="area">
    <rgb name="radiance" value="3, 2, 1"/></emitter><transform name="to_world">
    <scale value="0.5"/><translate z="0.7"/></transform></shape>"""


def test_result(scene_file: SceneFile) -> None:
    result = render(scene_file(**LIT))
    assert result.image.shape == (12, 16, 3)
    assert result.image.dtype == np.float32
    assert np.isfinite(result.image).all()
    assert result.image.max() > 0
    assert result.aovs == {}
    assert list(result.timings) == ["load", "build", "render"]
    assert all(seconds >= 0 for seconds in result.timings.values())
    assert result.counters["primary_rays"] == 16 * 12 * 2


def test_image_is_mitsubas(scene_file: SceneFile, scalar_variant: None) -> None:
    path = scene_file(**LIT)
    reference = np.array(mi.render(mi.load_file(str(path)), spp=512))
    image = render(path, spp=512).image
    # Only the positions of samples in their pixels differ: noise at edges, else close.
    difference = np.abs(image - reference)
    assert np.median(difference) < 1e-3 * reference.max()
    assert difference.max() < 0.15 * reference.max()
    np.testing.assert_allclose(image.mean((0, 1)), reference.mean((0, 1)), rtol=0.01)


def test_radiance_of_a_floor_by_hand(scene_file: SceneFile) -> None:
    lamp = """<emitter type="point"><point name="position" value="0, 0, 2"/>
        <rgb name="intensity" value="8, 4, 2"/></emitter>"""
    sensor = scene_files.SENSOR.replace(
        scene_files.TO_WORLD,
        '<float name="fov" value="0.01"/><transform name="to_world"><lookat '
        'origin="0.1, 0.2, 5" target="0.1, 0.2, 0" up="0, 1, 0"/></transform>',
    )
    image = render(scene_file(emitters=lamp, sensor=sensor)).image
    distance = np.sqrt(0.1**2 + 0.2**2 + 2**2)
    expected = 0.5 / np.pi * np.array([8, 4, 2]) * 2 / distance**3
    np.testing.assert_allclose(image, np.broadcast_to(expected, image.shape), rtol=1e-3)


def test_ways_of_giving_a_scene_agree(scene_file: SceneFile, scalar_variant: None) -> None:
    sensor = scene_files.SENSOR.replace(scene_files.TO_WORLD, "")
    sensor = sensor.replace(
        "<sampler", '<transform name="to_world"><translate z="-4"/></transform><sampler'
    )
    lamp = '<emitter type="point"><point name="position" value="1, 2, -3"/></emitter>'
    floor = '<shape type="rectangle"><boolean name="flip_normals" value="true"/></shape>'
    path = scene_file(sensor=sensor, emitters=lamp, shapes=floor)
    scene = scene_files.scene_dict(
        lamp={"type": "point", "position": [1, 2, -3]},
        floor={"type": "rectangle", "flip_normals": True},
    )
    scene["eye"]["to_world"] = mi.ScalarTransform4f().translate([0, 0, -4])
    image = render(path).image
    assert image.max() > 0
    for other in (str(path), scene, mi.load_file(str(path)), mi.load_dict(scene)):
        np.testing.assert_array_equal(render(other).image, image)


def test_seeds(scene_file: SceneFile) -> None:
    path = scene_file(**LIT)
    image = render(path, seed=3).image
    np.testing.assert_array_equal(render(path, seed=3).image, image)
    assert (render(path, seed=4).image != image).any()
    sampler = scene_files.SAMPLER.replace(
        "<integer", '<integer name="seed" value="2"/><integer'
    )
    seeded = scene_file(
        "seeded.xml", sensor=scene_files.SENSOR.replace(scene_files.SAMPLER, sampler), **LIT
    )
    np.testing.assert_array_equal(render(seeded, seed=1).image, image)


def test_threads(scene_file: SceneFile) -> None:
    path = scene_file(**LIT)
    before = dr.thread_count()
    images = [render(path, threads=n).image for n in (1, 2, 3)]
    assert dr.thread_count() == before
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0], images[2])
    with pytest.raises(SceneError):
        render(path.with_name("absent.xml"), threads=1)
    assert dr.thread_count() == before
    for count in (0, 100_000):
        with pytest.raises(MlrtError, match=f"threads = {count}"):
            render(path, threads=count)


def test_samples_per_pixel(scene_file: SceneFile) -> None:
    path = scene_file(**LIT)
    np.testing.assert_array_equal(render(path).image, render(path, spp=2).image)
    assert render(path, spp=5).counters["primary_rays"] == 16 * 12 * 5


def test_scenes_without_samples_name_their_sampler(scene_file: SceneFile) -> None:
    sampler = scene_files.SAMPLER.replace('"2"', '"0"')
    path = scene_file(sensor=scene_files.SENSOR.replace(scene_files.SAMPLER, sampler))
    expected = "sampler 'independent' at .*scene.xml line .* has sample_count = 0.*--spp"
    with pytest.raises(SceneError, match=expected):
        render(path)
    assert render(path, spp=1).image.any()


GLOW = """<shape type="rectangle">
<transform name="to_world"><scale value="100"/></transform>
<emitter type="area"><rgb name="radiance" value="0.37, 0.1, 5"/></emitter></shape>"""


@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
def test_millions_of_samples_keep_their_mean(scene_file: SceneFile, rfilter: str) -> None:
    """Single precision loses what is added to a large sum: a seventh of 10^7 samples."""
    sensor = scene_files.SENSOR.replace('value="16"', 'value="1"')
    sensor = sensor.replace('value="12"', 'value="1"').replace("box", rfilter)
    path = scene_file(shapes=GLOW, emitters="", sensor=sensor)
    image = render(path, spp=2_000_000, aovs=("depth",))
    np.testing.assert_allclose(image.image[0, 0], (0.37, 0.1, 5), rtol=2e-6)
    few = render(path, spp=1000, aovs=("depth",))
    np.testing.assert_allclose(image.aovs["depth"], few.aovs["depth"], rtol=1e-2)


def test_resolution_and_defines(scene_file: SceneFile) -> None:
    path = scene_file(sensor=scene_files.SENSOR.replace('value="16"', 'value="$width"'))
    assert render(path, defines={"width": 20}).image.shape == (12, 20, 3)
    image = render(path, defines={"width": 20}, resolution=(9, 7)).image
    assert image.shape == (7, 9, 3)


def test_aovs(scene_file: SceneFile) -> None:
    path = scene_file(sensor=scene_files.SENSOR.replace("0.3, 0.2, 5", "0, 0.1, 5"))
    aovs = render(path, spp=1, aovs=("depth", "normal", "prim")).aovs
    assert sorted(aovs) == ["depth", "normal", "prim"]
    assert aovs["normal"].shape == (12, 16, 3)
    prim = aovs["prim"].reshape(12, 16)
    hit = prim >= 0
    assert set(np.unique(prim)) == {-1, 0, 1}
    # The camera is 5 above the floor and sees at most 1.5 to the side.
    depth = aovs["depth"].reshape(12, 16)[hit]
    assert (depth > 4.9).all()
    assert (depth < np.hypot(5, 1.5)).all()
    np.testing.assert_allclose(aovs["normal"][hit], [[0, 0, 1]] * hit.sum(), atol=1e-6)


def test_visible_emitters(scene_file: SceneFile) -> None:
    path = scene_file(shapes=scene_files.FLOOR, emitters=GLOWING)
    image = render(path, aovs=("prim",)).image
    assert image.max() == pytest.approx(3)
    hidden = render(path, hide_emitters=True).image
    assert hidden.max() < 3


@pytest.mark.parametrize(
    "options",
    [
        {"entry_points": False},
        {"traversal": "single"},
        {"traversal": "interval", "initial_tile": 8, "minimum_tile": 4},
        {"culling": "frustum_planes"},
        {"max_depth": 2},
    ],
    ids=str,
)
def test_options_do_not_change_the_image(
    scene_file: SceneFile, options: dict[str, object]
) -> None:
    path = scene_file(**LIT)
    np.testing.assert_array_equal(render(path, **options).image, render(path).image)


def test_progress(scene_file: SceneFile) -> None:
    shares: list[float] = []
    render(scene_file(**LIT), resolution=(200, 200), spp=4, progress=shares.append)
    assert shares == sorted(shares)
    assert shares[0] >= 0
    assert shares[-1] == 1


def test_errors_of_progress_come_through(scene_file: SceneFile) -> None:
    def fail(share: float) -> None:
        raise RuntimeError("no bar")

    with pytest.raises(RuntimeError, match="no bar"):
        render(scene_file(**LIT), progress=fail)


def test_arguments(scene_file: SceneFile) -> None:
    path = scene_file()
    with pytest.raises(TypeError, match="'samples'"):
        render(path, samples=3)
    with pytest.raises(MlrtError, match="'albedo'"):
        render(path, aovs=("albedo",))
    with pytest.raises(MlrtError, match="not the string 'depth'"):
        render(path, aovs="depth")
    with pytest.raises(MlrtError, match="spp = 0"):
        render(path, spp=0)
    for seed in (-1, 2**32):
        with pytest.raises(MlrtError, match="seed = "):
            render(path, seed=seed)
    with pytest.raises(UnsupportedFeature, match="sdfgrid"):
        render(scene_file("grid.xml", shapes='<shape type="sdfgrid"/>'), shading="native")
    with pytest.raises(MlrtError, match="shading = 'fast' does not exist"):
        render(path, shading="fast")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("spp", 1.5),
        ("spp", "many"),
        ("seed", 1.5),
        ("sensor", 0.0),
        ("sensor", "left"),
        ("threads", 1.5),
        ("width", (8.5, 8)),
    ],
)
def test_whole_numbers_are_not_rounded(
    scene_file: SceneFile, name: str, value: object
) -> None:
    argument = "resolution" if name == "width" else name
    with pytest.raises(TypeError, match=f"{name} must be a whole number"):
        render(scene_file(), **{argument: value})


def test_too_much_of_everything(
    scene_file: SceneFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = scene_file()
    with pytest.raises(MlrtError, match=r"spp = 4294967296 is too many"):
        render(path, spp=2**32)
    with pytest.raises(MlrtError, match="threads = 1000000 is too many"):
        render(path, threads=1_000_000)
    with pytest.raises(ValueError, match="must be"):
        render(path, resolution=(8,))
    memory = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 100 * 100 * 64 // 4096}
    monkeypatch.setattr(os, "sysconf", memory.__getitem__)
    assert render(path, resolution=(99, 100)).image.shape == (100, 99, 3)
    with pytest.raises(MlrtError, match=r"hdrfilm.* 101x100 pixels.* memory"):
        render(path, resolution=(101, 100))


def test_warnings(scene_file: SceneFile) -> None:
    path = scene_file(integrator='<integrator type="path"/>')
    with pytest.warns(MlrtWarning, match="max_depth = -1") as caught:
        render(path, force_direct=True)
    assert [w.filename for w in caught] == [__file__]


def test_prepared_scene_is_rendered_again(scene_file: SceneFile) -> None:
    path = scene_file(**LIT)
    prepared = mlrt_plugin.prepare(path)
    for seed in (0, 1):
        again = prepared.render(seed=seed, spp=3)
        np.testing.assert_array_equal(again.image, render(path, seed=seed, spp=3).image)
    with pytest.raises(TypeError, match="'max_depth'"):
        prepared.render(max_depth=3)
    with pytest.raises(TypeError, match="'traversal'"):
        mlrt_plugin.prepare(path, traversal="single")


def many_blocks(count: int) -> str:
    """Cubes around the middle of the picture, apart from each other."""
    return "".join(
        f"""<shape type="cube"><transform name="to_world"><scale value="0.02"/>
        <translate x="{0.1 * (i % 7) - 0.3}" y="{0.1 * (i // 7) - 0.3}" z="0.5"/>
        </transform></shape>"""
        for i in range(count)
    )


# Large enough for beams of as many rays as there can be, which meet too many triangles.
LARGE_SENSOR = scene_files.SENSOR.replace("16", "256").replace("12", "256")
TRAVERSALS = ("adaptive", "wide", "beam_leaf", "packet", "interval", "single")


def check_cost(path: Path, traversal: str, spp: int, **options: Any) -> dict[str, Any]:
    """What counters count in all is what the picture holds, and none of it moves light.
    Returns the counters."""
    options |= {"traversal": traversal, "spp": spp}
    plain = render(path, **options)
    result = render(path, aovs=("cost",), **options)
    assert np.array_equal(result.image, plain.image)
    work = sum(
        result.counters[ray + name]
        for ray in ("primary_", "shadow_")
        for name in (
            "entry_steps",
            "traversal_steps",
            "beam_steps",
            "triangle_tests",
            "beam_triangles",
        )
    )
    cost = result.aovs["cost"]
    assert cost.shape == result.image.shape[:2]
    assert (cost >= 0).all() and cost.any()
    assert cost.sum(dtype=np.float64) * spp == pytest.approx(work, rel=1e-6)
    return result.counters


@pytest.mark.parametrize("traversal", TRAVERSALS)
def test_cost_tells_where_the_work_is(scene_file: SceneFile, traversal: str) -> None:
    check_cost(scene_file(), traversal, 2)
    blocks = scene_file(shapes=scene_files.FLOOR + many_blocks(49), sensor=LARGE_SENSOR)
    counters = check_cost(blocks, traversal, 1)
    if traversal == "adaptive":
        assert counters["primary_fallbacks"] > 0, "the case that this is about"


@pytest.mark.parametrize("traversal", TRAVERSALS)
def test_cost_of_shadows_of_an_area_light(traversal: str) -> None:
    """Rays that stop at the triangle where one did before take a test as well."""
    path = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"
    check_cost(path, traversal, 4, resolution=(64, 64))
