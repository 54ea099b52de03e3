"""Native BSDF samples: the image of Mitsuba's `direct` with as many, sample by sample."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import plugin_scenes as parts
import pytest
from mlrt_compare.metrics import differing_mask
from native_parity import assert_parity
from plugin_scenes import COMPENSATED, CONSTANT, SKY

from mlrt_plugin import prepare


def lamp_shape(plugin: str, to_world: str, more: str = "") -> str:
    return (
        f'<shape type="{plugin}">{more}<transform name="to_world">{to_world}</transform>'
        '<emitter type="area"><rgb name="radiance" value="4, 5, 6"/></emitter></shape>'
    )


PLAIN = parts.bsdf("diffuse", parts.colour("reflectance"))
TWO_SIDES = parts.bsdf(
    "twosided", parts.bsdf("diffuse", parts.colour("reflectance")) + parts.bsdf("diffuse")
)
BOARD = (
    parts.colour("color0", ".2")
    + parts.colour("color1", "0.8")
    + '<transform name="to_uv"><scale x="5" y="3"/></transform>'
)
MASK = parts.bsdf("mask", parts.texture("opacity", "checkerboard", BOARD) + TWO_SIDES)
HALF = parts.bsdf("mask", parts.bsdf("diffuse") + parts.number("opacity", 0.4))
PHOTOGRAPH = parts.bsdf(
    "diffuse",
    parts.texture("reflectance", "bitmap", parts.text("filename", "image.png")),
)

BALL = lamp_shape("sphere", '<scale value="0.5"/><translate x="1" y="2.2" z="1"/>')
DISK = lamp_shape(
    "disk",
    '<scale x="0.8" y="0.5"/><rotate x="1" angle="80"/><translate x="-1" y="2.5" z="0.6"/>',
)
TUBE = lamp_shape(
    "cylinder",
    '<scale x="0.2" y="0.2" z="1.5"/><rotate y="1" angle="70"/>'
    '<translate x="-1" y="1.8" z="0.8"/>',
)
MESH = lamp_shape(
    "cube",
    '<scale value="0.4"/><rotate y="1" angle="30"/><translate x="1.2" y="2" z="0.5"/>',
)
AROUND = lamp_shape(
    "sphere", '<scale value="9"/>', '<boolean name="flip_normals" value="true"/>'
)
LIGHTER_BALL = BALL.replace(
    '<emitter type="area">',
    '<emitter type="area"><float name="sampling_weight" value="3"/>',
)


SMOOTH = parts.block(PLAIN + parts.text("filename", "smooth.ply"), 0, "ply", 0.9)
GROUP = (
    '<shape type="shapegroup" id="group">'
    + parts.block(PLAIN)
    + parts.block(PLAIN, 0.6, "sphere", 0.3)
    + parts.block(PLAIN, -0.6, "disk", 0.3)
    + parts.block(PLAIN + parts.text("filename", "smooth.ply"), 1.2, "ply", 0.4)
    + "</shape>"
)
INSTANCES = GROUP + "".join(
    f'<shape type="instance"><ref id="group"/><transform name="to_world">{place}'
    "</transform></shape>"
    for place in (
        '<scale x="0.8" y="1.4" z="0.5"/><rotate y="1" angle="40"/><translate x="-1.2"/>',
        '<rotate x="0.6" y="0.8" angle="-30"/><translate x="1" z="0.7"/>',
    )
)


class Case(NamedTuple):
    lights: str
    body: str = parts.block(PLAIN) + parts.block(PLAIN, -1.6, "sphere", 0.5)
    emitter_samples: int = 1
    bsdf_samples: int = 1
    hide_emitters: bool = False
    eye: str | None = None

    def xml(self) -> str:
        integrator = (
            f'<integrator type="direct">'
            f'<integer name="emitter_samples" value="{self.emitter_samples}"/>'
            f'<integer name="bsdf_samples" value="{self.bsdf_samples}"/>'
            f'<boolean name="hide_emitters" value="{str(self.hide_emitters).lower()}"/>'
            "</integrator>"
        )
        return parts.scene(self.body, self.lights, self.eye, integrator)


ROW = parts.block(MASK, 0, "rectangle", 1) + parts.block(HALF, 1.5)
MIXED = parts.block(PHOTOGRAPH) + parts.block(MASK, -1.6, "rectangle", 0.7)
CASES = {
    "rectangle": Case(parts.PANEL),
    "mesh": Case(MESH),
    "sphere": Case(BALL),
    "inside of a sphere": Case(AROUND),
    "disk": Case(DISK),
    "cylinder": Case(TUBE),
    "envmap": Case(SKY),
    "compensated envmap": Case(COMPENSATED, bsdf_samples=2),
    "constant": Case(CONSTANT),
    "several lights": Case(BALL + SKY + parts.LAMP + parts.PANEL),
    "weighted lights": Case(LIGHTER_BALL + CONSTANT + parts.PANEL),
    "more of emitters": Case(BALL + SKY, emitter_samples=3, bsdf_samples=2),
    "more of materials": Case(parts.PANEL, bsdf_samples=3),
    "no emitter samples": Case(BALL + SKY, emitter_samples=0, bsdf_samples=2),
    "lamp among lights": Case(parts.LAMP + BALL, emitter_samples=3),
    "masks": Case(BALL + SKY, ROW, bsdf_samples=2),
    "null": Case(
        BALL + SKY,
        parts.block(parts.bsdf("null"))
        + parts.block(parts.bsdf("mask", parts.bsdf("null")), -1.6, "rectangle", 0.5),
    ),
    "two sides": Case(
        BALL + SKY,
        parts.block(TWO_SIDES, 0, "rectangle", 0.8)
        + parts.block(TWO_SIDES, -1.6, "disk", 0.5),
    ),
    "textures": Case(BALL + CONSTANT, MIXED),
    "smooth mesh": Case(BALL + CONSTANT, SMOOTH),
    "instances": Case(BALL + CONSTANT, INSTANCES),
    "hidden emitters": Case(BALL + SKY + parts.PANEL, hide_emitters=True),
    "hidden emitters behind masks": Case(
        BALL + SKY, ROW, bsdf_samples=2, hide_emitters=True
    ),
    **{
        sampler: Case(
            BALL + SKY,
            MIXED,
            emitter_samples=2,
            bsdf_samples=2,
            eye=parts.sensor(sampler=sampler, spp=spp),
        )
        for sampler, spp in (
            ("stratified", 9),
            ("multijitter", 6),
            ("orthogonal", 9),
            ("ldsampler", 16),
        )
    },
}


@pytest.mark.parametrize("name", CASES)
def test_image_is_that_of_direct(assets: Path, name: str) -> None:
    case = CASES[name]
    path = assets / f"bsdf-{name.replace(' ', '-')}.xml"
    path.write_text(case.xml())
    assert_parity(
        path,
        emitter_samples=case.emitter_samples,
        bsdf_samples=case.bsdf_samples,
        hide_emitters=case.hide_emitters,
    )


def test_samples_make_a_difference(assets: Path) -> None:
    """Without them the comparisons above would fail."""
    path = assets / "bsdf-difference.xml"
    images = []
    for bsdf_samples in (0, 1):
        path.write_text(Case(BALL + SKY, bsdf_samples=bsdf_samples).xml())
        images.append(prepare(path).render(seed=1).image)
    assert np.mean(differing_mask(*images)) > 0.3


def test_robust_offsets_change_the_noise_only(assets: Path) -> None:
    path = assets / "bsdf-robust.xml"
    path.write_text(Case(BALL + SKY, ROW).xml())
    prepared = prepare(path)
    images = [
        prepared.render(seed=1, shadow_offset=offset).image
        for offset in ("mitsuba", "robust")
    ]
    # Rays start elsewhere by far less than a pixel.
    assert np.mean(differing_mask(*images)) < 0.02
    assert images[0].mean() == pytest.approx(images[1].mean(), rel=1e-2)


@pytest.mark.parametrize("traversal", ["single", "interval", "brute_force"])
def test_traversals_agree_bit_for_bit(assets: Path, traversal: str) -> None:
    path = assets / "bsdf-traversal.xml"
    path.write_text(Case(BALL + SKY, ROW, bsdf_samples=2).xml())
    prepared = prepare(path)
    np.testing.assert_array_equal(
        prepared.render(seed=1, traversal=traversal).image, prepared.render(seed=1).image
    )
