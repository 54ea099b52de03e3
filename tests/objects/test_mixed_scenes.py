"""Textured meshes, analytic shapes and instances in one scene, under a sky, against
Mitsuba's picture with the same seed."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from mitsuba_worker import MitsubaWorker

import mlrt_plugin

SEED, SPP = 3, 4

ORTHOGRAPHIC = '<scale x="2.6" y="2.6"/>'
SENSORS = {
    "orthographic": ("", ORTHOGRAPHIC),
    "thinlens": (
        '<float name="fov" value="42"/><float name="aperture_radius" value="0.08"/>'
        '<float name="focus_distance" value="6"/>',
        "",
    ),
    "perspective": ('<float name="fov" value="42"/>', ""),
}

# Faces 0 and 1 are the floor's, 2 and 3 the sheet's; those of the group follow, 12 of its
# cube, then come the spheres and the disk of the scene, and the group's sphere.
PARTS = {"floor": (0, 2), "sheet": (2, 4), "cube": (4, 16), "analytic": (16, 20)}

SCENE = """<scene version="3.0.0">
<integrator type="direct">
  <integer name="emitter_samples" value="1"/><integer name="bsdf_samples" value="0"/>
</integrator>
<sensor type="{plugin}">{properties}
  <transform name="to_world">{scale}
    <lookat origin="0, 2.5, 6" target="0, 0.8, 0" up="0, 1, 0"/></transform>
  <film type="hdrfilm">
    <integer name="width" value="120"/><integer name="height" value="90"/>
    <string name="component_format" value="float32"/><rfilter type="box"/></film>
  <sampler type="stratified"><integer name="sample_count" value="4"/></sampler>
</sensor>
<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>
<shape type="rectangle">
  <transform name="to_world">
    <scale value="2.4"/><rotate x="1" angle="-90"/></transform>
  <bsdf type="diffuse"><texture type="bitmap" name="reflectance">
    <string name="filename" value="tiles.png"/>
    <transform name="to_uv"><scale x="3" y="2"/></transform></texture></bsdf>
</shape>
<shape type="rectangle">
  <transform name="to_world"><scale value="0.6"/><translate x="-1.2" y="2.1" z="-0.6"/>
  </transform>
  <bsdf type="mask"><texture type="checkerboard" name="opacity">
    <rgb name="color0" value="0.2"/><rgb name="color1" value="0.9"/></texture>
    <bsdf type="twosided"><bsdf type="diffuse">
      <rgb name="reflectance" value="0.8, 0.5, 0.1"/></bsdf></bsdf></bsdf>
</shape>
<shape type="sphere"><point name="center" x="0.1" y="0.6" z="0.4"/>
  <float name="radius" value="0.6"/>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.2, 0.2"/></bsdf></shape>
<shape type="sphere"><point name="center" x="1.6" y="2" z="0.6"/>
  <float name="radius" value="0.25"/>
  <emitter type="area"><rgb name="radiance" value="9, 8, 6"/></emitter></shape>
<shape type="disk">
  <transform name="to_world"><scale value="0.5"/><rotate y="1" angle="-25"/>
    <translate x="0.9" y="1.5" z="-0.8"/></transform>
  <bsdf type="conductor"/></shape>
<shape type="shapegroup" id="group">
  <shape type="cube"><transform name="to_world"><scale value="0.3"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.2, 0.5, 0.8"/></bsdf></shape>
  <shape type="sphere"><point name="center" x="0" y="0.5" z="0"/>
    <float name="radius" value="0.25"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.3, 0.7, 0.3"/></bsdf></shape>
</shape>
<shape type="instance"><ref id="group"/><transform name="to_world">
  <rotate y="1" angle="35"/><translate x="-1.3" y="0.3" z="0.6"/></transform></shape>
<shape type="instance"><ref id="group"/><transform name="to_world">
  <scale x="1" y="1.5" z="0.6"/><rotate y="1" angle="-20"/>
  <translate x="1.4" y="0.45" z="0"/></transform></shape>
</scene>"""


def write_scene(folder: Path, sensor: str) -> Path:
    random = np.random.default_rng(20_050_804)
    tiles = (random.random((6, 5, 3)) * 255).astype(np.uint8)
    mi.Bitmap(tiles).write(str(folder / "tiles.png"))
    sky = random.random((9, 16, 3), np.float32) * np.float32(0.6)
    sky[2, 5] = (60, 50, 40)
    mi.Bitmap(sky).write(str(folder / "sky.exr"))
    properties, scale = SENSORS[sensor]
    path = folder / f"{sensor}.xml"
    path.write_text(SCENE.format(plugin=sensor, properties=properties, scale=scale))
    return path


@pytest.mark.parametrize("sensor", SENSORS)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, tmp_path: Path, sensor: str
) -> None:
    path = write_scene(tmp_path, sensor)
    expected = mitsuba_llvm("render_file", path=str(path), spp=SPP, seed=SEED)
    prepared = mlrt_plugin.prepare(path, shading="native")
    for offset, share in (("mitsuba", 0.001), ("robust", 0.002)):
        result = prepared.render(spp=SPP, seed=SEED, shadow_offset=offset, aovs=("prim",))
        seen = result.aovs["prim"]
        for first, end in PARTS.values():
            assert np.mean((seen >= first) & (seen < end)) > 0.01
        assert np.mean(seen == -1) > 0.1
        error = np.abs(result.image - expected).max(axis=-1)
        differs = error > 1e-3 * np.maximum(expected.max(axis=-1), 1e-3 * expected.mean())
        # Samples on silhouettes and borders of shadows and squares, where rounding decides.
        assert np.mean(differs) < share
        rmse = np.sqrt(np.mean(error[~differs] ** 2))
        assert rmse < 1e-4 * expected.mean()


def test_picture_depends_neither_on_traversal_nor_on_threads(tmp_path: Path) -> None:
    path = write_scene(tmp_path, "thinlens")
    scene = mlrt_plugin.prepare(path, shading="native")
    expected = scene.render(seed=SEED).image
    for traversal in ("single", "packet", "brute_force"):
        image = scene.render(seed=SEED, traversal=traversal).image
        np.testing.assert_array_equal(image, expected)
    # With one thread Mitsuba needs help to read the sky at all.
    one = mlrt_plugin.render(path, seed=SEED, threads=1, shading="native").image
    np.testing.assert_array_equal(one, expected)
