"""Frames in passes: numbers, memory, AOVs, parameters of the integrator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import plugin_scenes as parts
import pytest

from mlrt_plugin import MlrtWarning, prepare, render
from mlrt_plugin.hybrid import samplers
from mlrt_plugin.hybrid.samplers import IndependentStream, Pass, passes

BODY = parts.row_of_materials(
    parts.bsdf("roughplastic"), parts.bsdf("diffuse"), parts.bsdf("roughconductor")
)


def written(folder: Path, **more: Any) -> Path:
    path = folder / "frame.xml"
    path.write_text(parts.scene(BODY, **more))
    return path


@pytest.mark.parametrize(("pixels", "spp"), [(7, 3), (1000, 64), (1, 5000), (9, 1)])
@pytest.mark.parametrize("whole", [False, True])
def test_passes_take_each_sample_once(
    monkeypatch: pytest.MonkeyPatch, pixels: int, spp: int, whole: bool
) -> None:
    monkeypatch.setattr(samplers, "SAMPLES_OF_PASS", 1000)
    parts_of_image = list(passes(pixels, spp, whole))
    taken = []
    for p in parts_of_image:
        pixel, sample = np.divmod(np.arange(p.first, p.first + p.count), p.spp)
        taken.append(pixel * p.stride + p.start + sample)
    numbers = np.concatenate(taken)
    if spp <= samplers.MOST_SUMMANDS:
        np.testing.assert_array_equal(numbers, np.arange(pixels * spp))
    np.testing.assert_array_equal(np.sort(numbers), np.arange(pixels * spp))
    assert all(p.count <= max(1000, spp if whole else 0) for p in parts_of_image)
    if whole:
        assert all(p.first % spp == p.count % spp == 0 for p in parts_of_image)


def test_images_of_more_than_32_bits_are_numbered_as_natively() -> None:
    """Two wavefronts of 2^31 pixels and 3 samples: 1 a pixel in each, as in sampler.h."""
    pixels, spp = 2**31, 3
    found = [(p.wavefront, p.spp, p.stride) for p in passes(pixels, spp, False)]
    assert set(found) == {(0, 1, 1), (1, 1, 1), (2, 1, 1)}


@pytest.mark.parametrize("spp", [1, 5])
def test_numbers_are_those_of_mitsubas_sampler(spp: int) -> None:
    module = mi.llvm_ad_rgb  # type: ignore[attr-defined]
    pixels, seed = 100, 9
    sampler = mi.load_dict({"type": "independent", "sample_count": spp})
    sampler.set_samples_per_wavefront(spp)
    sampler.seed(seed, pixels * spp)
    mask = np.arange(pixels * spp) % 3 > 0
    first, count = 40, 50
    stream = IndependentStream(module, seed, Pass(0, 0, spp, spp, first, count))
    run = slice(first, first + count)
    for active in (np.ones_like(mask), mask, np.ones_like(mask)):
        expected = np.array(sampler.next_2d(module.Bool(active)))[:, run][:, active[run]]
        numbers = np.array(stream.next_2d(module.Bool(active[run])))[:, active[run]]
        np.testing.assert_array_equal(numbers, expected)


def test_image_does_not_depend_on_passes(
    assets: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """But for the order in which a pixel's samples are summed up."""
    path = written(assets, eye=parts.sensor(spp=7))
    whole = render(path, seed=2, aovs=("depth", "normal", "prim"))
    monkeypatch.setattr(samplers, "SAMPLES_OF_PASS", 1000)
    progress: list[float] = []
    split = render(path, seed=2, aovs=("depth", "normal", "prim"), progress=progress.append)
    assert len(progress) == 13 and progress == sorted(progress) and progress[-1] == 1
    np.testing.assert_allclose(split.image, whole.image, rtol=1e-5, atol=1e-7)
    np.testing.assert_array_equal(split.aovs["prim"], whole.aovs["prim"])
    for name in ("depth", "normal"):
        np.testing.assert_allclose(split.aovs[name], whole.aovs[name], atol=1e-5)


def test_many_samples_keep_their_mean(assets: Path) -> None:
    """The film of Mitsuba adds up in single precision, so it is emptied now and then."""
    glow = """<shape type="rectangle"><transform name="to_world"><scale value="100"/>
    </transform><emitter type="area"><rgb name="radiance" value="0.37, 0.1, 5"/></emitter>
    </shape>"""
    path = assets / "glow.xml"
    path.write_text(
        parts.scene(glow, lights="", floor="", eye=parts.sensor(size=(3, 2), spp=9))
    )
    spp = 10 * samplers.MOST_SUMMANDS + 5
    many = render(path, spp=spp, shading="mitsuba", aovs=("depth", "prim"))
    expected = np.broadcast_to((0.37, 0.1, 5), (2, 3, 3))
    np.testing.assert_allclose(many.image, expected, rtol=1e-4)
    few = render(path, spp=9, shading="mitsuba", aovs=("depth", "prim"))
    np.testing.assert_allclose(many.aovs["depth"], few.aovs["depth"], rtol=1e-2)
    np.testing.assert_array_equal(many.aovs["prim"], few.aovs["prim"])


@pytest.mark.parametrize("name", ["stratified", "ldsampler"])
def test_other_samplers_in_passes_have_the_same_mean(
    assets: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = written(assets, eye=parts.sensor(sampler=name, spp=64))
    whole = render(path).image
    monkeypatch.setattr(samplers, "SAMPLES_OF_PASS", 1000)
    split = render(path).image
    assert np.any(split != whole)
    assert split.mean() == pytest.approx(whole.mean(), rel=0.01)


def test_samplers_that_round_say_so(assets: Path) -> None:
    path = written(assets, eye=parts.sensor(sampler="stratified", spp=16))
    with pytest.warns(MlrtWarning, match="takes 16 samples a pixel in place of 10"):
        render(path, spp=10)


def test_aovs_are_those_of_mitsuba(assets: Path) -> None:
    path = written(assets, eye=parts.sensor(rfilter="gaussian"))
    result = render(path, seed=4, aovs=("depth", "normal", "prim"))
    scene = mi.load_file(str(path), optimize=False)
    integrator = mi.load_dict({"type": "aov", "aovs": "d:depth,n:sh_normal"})
    expected = np.array(mi.render(scene, integrator=integrator, seed=4))
    # Tolerances, as a ray at an edge may be decided in another way.
    depth = np.abs(result.aovs["depth"] - expected[..., 0])
    assert np.count_nonzero(depth > 1e-4 * expected[..., 0].max()) <= 4
    normal = np.abs(result.aovs["normal"] - expected[..., 1:]).max(axis=-1)
    assert np.count_nonzero(normal > 1e-4) <= 4
    faces = result.aovs["prim"]
    assert faces.min() == -1 and faces.max() < 2 + 3 * 12 + 2
    assert np.all(result.aovs["depth"][faces >= 0] > 0)


@pytest.mark.parametrize(("emitter_samples", "bsdf_samples"), [(2, 0), (0, 1), (3, 2)])
@pytest.mark.parametrize("hide", [False, True])
@pytest.mark.filterwarnings("ignore:.*its issue 1861")
def test_samples_are_taken_as_direct_does(
    assets: Path, emitter_samples: int, bsdf_samples: int, hide: bool
) -> None:
    counts = {"emitter_samples": emitter_samples, "bsdf_samples": bsdf_samples}
    xml = "".join(f'<integer name="{n}" value="{c}"/>' for n, c in counts.items())
    xml += f'<boolean name="hide_emitters" value="{str(hide).lower()}"/>'
    # Two panels one behind the other: hidden ones are looked through.
    panels = parts.PANEL.replace('y="3"', 'y="1" z="2"') + parts.PANEL
    path = written(
        assets,
        integrator=f'<integrator type="direct">{xml}</integrator>',
        lights=parts.LAMP + panels,
    )
    image = render(path, seed=6, shading="mitsuba").image
    scene = mi.load_file(str(path), optimize=False)
    expected = np.array(mi.render(scene, seed=6))
    differing = np.abs(image - expected).max(axis=-1) > 1e-4 * expected.max()
    assert np.count_nonzero(differing) <= 2


def test_loaded_scenes_are_shaded_in_place(assets: Path) -> None:
    path = written(assets)
    expected = render(path, seed=5).image
    scene = mi.load_file(str(path), optimize=False)
    integrator = mi.load_dict({"type": "mlrt", "bsdf_samples": 1})
    image = np.array(mi.render(scene, integrator=integrator, seed=5))
    np.testing.assert_allclose(image, expected, rtol=1e-5, atol=1e-7)
    tree = integrator.prepared.tree
    mi.render(scene, integrator=integrator, seed=5)
    assert integrator.prepared.tree is tree
    assert dr.flag(dr.JitFlag.SymbolicCalls)


def test_depth_is_that_of_mitsuba(assets: Path) -> None:
    path = written(assets, integrator='<integrator type="depth"/>')
    scene = mi.load_file(str(path), optimize=False)
    expected = np.array(mi.render(scene, seed=1))[..., :3]
    image = render(path, seed=1).image
    differing = np.abs(image - expected).max(axis=-1) > 1e-4 * expected.max()
    assert np.count_nonzero(differing) <= 2 and image.max() > 0


@pytest.mark.parametrize("inner", ["direct", "path"])
def test_moments_are_those_of_mitsuba(assets: Path, inner: str) -> None:
    depth = '<integer name="max_depth" value="2"/>' if inner == "path" else ""
    path = written(
        assets,
        integrator=f'<integrator type="moment"><integrator type="{inner}">{depth}'
        "</integrator></integrator>",
    )
    mi.set_variant("scalar_rgb")  # what the caller has set is not what shades
    result = render(path, seed=8)
    mi.set_variant("llvm_ad_rgb")
    scene = mi.load_file(str(path), optimize=False)
    if inner == "path":
        # Its samples are as many, but drawn in another order.
        direct = mi.load_dict({"type": "moment", "nested": {"type": "direct"}})
        expected = np.array(mi.render(scene, integrator=direct, seed=8))
    else:
        expected = np.array(mi.render(scene, seed=8))
    assert expected.shape[2] == 9 and result.aovs["moment"].shape[2] == 6
    whole = np.concatenate([result.image, result.aovs["moment"]], axis=2)
    differing = np.abs(whole - expected).max(axis=-1) > 1e-4 * expected.max()
    assert np.count_nonzero(differing) <= 2


def test_mitsubas_scene_has_the_lights_and_the_bounds_only(assets: Path) -> None:
    """No second acceleration structure is built over what is in the tree."""
    path = written(assets)
    loaded = prepare(path).loaded
    whole = mi.load_file(str(path), optimize=False)
    assert len(loaded.shapes) == len(whole.shapes()) == 8
    assert [s.is_emitter() for s in loaded.scene.shapes()] == [True, False]
    assert len(loaded.scene.emitters()) == len(whole.emitters()) == 2
    bounds, expected = loaded.scene.bbox(), whole.bbox()
    np.testing.assert_array_equal(np.array(bounds.min), np.array(expected.min))
    np.testing.assert_array_equal(np.array(bounds.max), np.array(expected.max))
