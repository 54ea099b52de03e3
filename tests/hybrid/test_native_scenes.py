"""Scene files that are rendered natively give the image of Mitsuba's `direct`, sample by
sample."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import plugin_scenes as parts
import pytest
from native_parity import assert_parity
from plugin_scenes import COMPENSATED, CONSTANT, SKY

from mlrt_plugin import MlrtError, prepare
from mlrt_plugin.samplers import possible_spp
from mlrt_plugin.scene_arrays import Sampler

GLOSSLESS = parts.block(parts.bsdf("diffuse", parts.colour("reflectance")))
NO_BSDF_SAMPLES = (
    '<integrator type="direct"><integer name="emitter_samples" value="1"/>'
    '<integer name="bsdf_samples" value="0"/></integrator>'
)


NEVER_CHOSEN = parts.PANEL.replace(
    '<emitter type="area">',
    '<emitter type="area"><float name="sampling_weight" value="0"/>',
)
WIDE_VIEW = parts.VIEW.replace("<lookat", '<scale x="2.5" y="2.2"/><lookat')
LENS = parts.number("aperture_radius", 0.2) + parts.number("focus_distance", 5.5)
SHUTTER = parts.number("shutter_open", 0.1) + parts.number("shutter_close", 0.6)
SAMPLERS = {
    "stratified": 9,
    "multijitter": 10,
    "orthogonal": 5,
    "ldsampler": 16,
}


def projector(picture: str, more: str = "", move: str = "") -> str:
    return (
        f'<emitter type="projector"><transform name="to_world">{move}<lookat '
        'origin="-2, 3, 3" target="0, 0.4, 0" up="0.2, 1, 0"/></transform>'
        f"{picture}{more}</emitter>"
    )


PICTURE = parts.texture("irradiance", "bitmap", parts.text("filename", "image.png"))
BOARD = parts.texture("irradiance", "checkerboard")


def scene(**more: str) -> str:
    return parts.scene(GLOSSLESS, integrator=NO_BSDF_SAMPLES, **more)


SCENES = {
    "envmap": scene(lights=SKY),
    "compensated envmap": scene(lights=COMPENSATED + parts.LAMP),
    "projector": scene(lights=projector(PICTURE, parts.number("scale", 12))),
    "projector by its height": scene(
        lights=projector(PICTURE, parts.number("fov", 50) + parts.text("fov_axis", "y"))
    ),
    "projector that is scaled": scene(
        lights=projector(PICTURE, move='<scale x="1.5" y="-0.7" z="2"/>')
    ),
    "projector of a colour": scene(lights=projector(parts.colour("irradiance"))),
    "projector among lights": scene(
        lights=projector(BOARD, parts.number("scale", 20)) + parts.PANEL + parts.LAMP
    ),
    "constant": scene(lights=CONSTANT + parts.LAMP),
    "area light that is never chosen": scene(
        lights=parts.LAMP
        + NEVER_CHOSEN
        + '<emitter type="spot"><transform name="to_world"><lookat origin="-2, 4, 3" '
        'target="0, 0, 0" up="0, 1, 0"/></transform></emitter>'
    ),
    "envmap among lights": scene(lights=parts.PANEL + SKY + parts.LAMP),
    "thinlens": scene(eye=parts.sensor("thinlens", LENS)),
    "orthographic": scene(eye=parts.sensor("orthographic", view=WIDE_VIEW)),
    "shutter": scene(eye=parts.sensor(parameters=SHUTTER)),
    "lens and shutter": scene(
        eye=parts.sensor("thinlens", LENS + SHUTTER, sampler="multijitter", spp=6)
    ),
    **{
        name: scene(eye=parts.sensor(sampler=name, spp=spp))
        for name, spp in SAMPLERS.items()
    },
    "orthogonal without jitter": scene(
        eye=parts.sensor(sampler="orthogonal", spp=9).replace(
            "</sampler>",
            '<boolean name="jitter" value="false"/><integer name="seed" value="5"/>'
            "</sampler>",
        )
    ),
}


@pytest.mark.parametrize("sampler", ["independent", "stratified", "ldsampler"])
def test_several_emitter_samples(assets: Path, sampler: str) -> None:
    path = assets / f"native-emitter-samples-{sampler}.xml"
    integrator = NO_BSDF_SAMPLES.replace('value="1"', 'value="3"')
    lights = parts.PANEL + SKY
    eye = parts.sensor(sampler=sampler)
    path.write_text(parts.scene(GLOSSLESS, lights, eye, integrator))
    assert_parity(path, emitter_samples=3)


@pytest.mark.parametrize("lights", [parts.LAMP, parts.LAMP + SKY])
def test_light_from_one_direction_counts_for_each_sample(assets: Path, lights: str) -> None:
    """As in Mitsuba (its issue 1861), with a warning."""
    path = assets / "native-lamp.xml"
    integrator = NO_BSDF_SAMPLES.replace('value="1"', 'value="4"')
    path.write_text(parts.scene(GLOSSLESS, lights, integrator=integrator))
    assert_parity(path, emitter_samples=4)
    (warning,) = prepare(path).warnings
    assert "4 times with emitter_samples = 4" in warning


@pytest.mark.parametrize("sampler", SAMPLERS)
@pytest.mark.parametrize("spp", [1, 2, 3, 5, 8, 10, 15, 16, 17, 30, 50, 122, 300])
def test_samples_per_pixel_are_mitsubas(sampler: str, spp: int) -> None:
    plugin = mi.load_dict({"type": sampler})
    plugin.set_sample_count(spp)
    assert possible_spp(Sampler(sampler), spp, 1) == plugin.sample_count()


def test_a_sampler_says_that_it_takes_more_samples(assets: Path) -> None:
    path = assets / "native-rounded.xml"
    path.write_text(scene(eye=parts.sensor(sampler="stratified", spp=4)))
    prepared = prepare(path)
    result = prepared.render(spp=5)
    assert result.warnings[-1] == (
        "sampler 'stratified' takes 9 samples a pixel in place of 5"
    )
    np.testing.assert_array_equal(result.image, prepared.render(spp=9).image)
    with pytest.raises(MlrtError, match="32 bits: choose sampler independent"):
        prepared.render(spp=2**24)


@pytest.mark.parametrize("name", SCENES)
def test_image_is_that_of_direct(assets: Path, name: str) -> None:
    path = assets / f"native-{name.replace(' ', '-')}.xml"
    path.write_text(SCENES[name])
    assert_parity(path)


@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
def test_moments_are_those_of_mitsuba(assets: Path, rfilter: str) -> None:
    """With the colours, the samples in XYZ, and their squares."""
    path = assets / f"native-moment-{rfilter}.xml"
    integrator = f'<integrator type="moment">{NO_BSDF_SAMPLES}</integrator>'
    lights, eye = parts.PANEL + SKY, parts.sensor(rfilter=rfilter)
    path.write_text(parts.scene(GLOSSLESS, lights, eye, integrator))
    prepared = prepare(path)
    assert prepared.shading.path == "native"
    result = prepared.render(seed=8)
    mi.set_variant("llvm_ad_rgb")
    expected = np.array(mi.render(mi.load_file(str(path), optimize=False), seed=8))
    whole = np.concatenate([result.image, result.aovs["moment"]], axis=2)
    assert expected.shape == whole.shape and expected.shape[2] == 9
    differing = np.abs(whole - expected) > 1e-4 * np.abs(expected).max(axis=(0, 1))
    assert np.count_nonzero(differing.any(axis=2)) <= 3
    noise = whole[..., 6:] - whole[..., 3:6] ** 2
    assert noise.min() > -1e-4 and noise.max() > 1e-3
