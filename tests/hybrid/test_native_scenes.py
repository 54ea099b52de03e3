"""Scene files that are rendered natively give the image of Mitsuba's `direct`, sample by
sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plugin_scenes as parts
import pytest
from mlrt_compare.metrics import differing_mask
from mlrt_compare.mitsuba_renderer import MitsubaRenderer
from mlrt_compare.settings import Settings

from mlrt_plugin import prepare

SEED = 7
ROUNDING = 1e-4
"""Of the mean; Mitsuba's barycentrics are in single precision."""
GLOSSLESS = parts.block(parts.bsdf("diffuse", parts.colour("reflectance")))
NO_BSDF_SAMPLES = (
    '<integrator type="direct"><integer name="emitter_samples" value="1"/>'
    '<integer name="bsdf_samples" value="0"/></integrator>'
)
SKY = (
    '<emitter type="envmap"><string name="filename" value="sky.exr"/>'
    '<float name="scale" value="0.7"/><transform name="to_world">'
    '<rotate x="1" angle="20"/><rotate y="1" angle="75"/></transform></emitter>'
)
CONSTANT = f'<emitter type="constant">{parts.colour("radiance")}</emitter>'


def scene(**more: str) -> str:
    return parts.scene(GLOSSLESS, integrator=NO_BSDF_SAMPLES, **more)


SCENES = {
    "envmap": scene(lights=SKY),
    "constant": scene(lights=CONSTANT + parts.LAMP),
    "envmap among lights": scene(lights=parts.PANEL + SKY + parts.LAMP),
}


def assert_parity(path: Path, **integrator: int) -> None:
    """integrator: parameters of `direct` beside those of no BSDF sample."""
    prepared = prepare(path)
    assert prepared.shading.path == "native"
    image = prepared.render(seed=SEED).image
    reference = MitsubaRenderer(
        Settings(path, seed=SEED),
        {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, **integrator},
        keep_sampler=True,
    )
    reference.frame()
    assert image.shape == reference.image.shape and image.max() > 0
    # Where a ray grazes an edge, Embree and the exact test may decide in different ways.
    differing = differing_mask(image, reference.image)
    assert np.count_nonzero(differing) <= max(2, differing.size // 500)
    error = np.sqrt(np.mean((image - reference.image)[~differing] ** 2))
    assert error < ROUNDING * reference.image.mean()


@pytest.mark.parametrize("name", SCENES)
def test_image_is_that_of_direct(assets: Path, name: str) -> None:
    path = assets / f"native-{name.replace(' ', '-')}.xml"
    path.write_text(SCENES[name])
    assert_parity(path)
