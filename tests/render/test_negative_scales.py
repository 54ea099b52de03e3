"""Shapes that a to_world mirrors, against Mitsuba's `direct` with the same numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plugin_scenes as parts
import pytest
import texture_scenes
from mitsuba_worker import MitsubaWorker

import mlrt_plugin

SEED, SPP = 5, 4
SCALES = ('x="-1"', 'value="-1"', 'x="0.5" z="-2"')
PLUGINS = ("rectangle", "cube", "sphere", "disk", "cylinder")
MATERIALS = {"matte": parts.bsdf("diffuse"), "light": '<emitter type="area"/>'}


def mirrored(shape: str, scale: str, content: str) -> str:
    return (
        f'<shape {shape}<transform name="to_world"><scale {scale}/><scale value="0.6"/>'
        f'<rotate y="1" angle="25"/><translate y="0.6"/></transform>{content}</shape>'
    )


def compare(mitsuba_llvm: MitsubaWorker, path: Path, body: str) -> None:
    path.write_text(parts.scene(body, integrator=texture_scenes.DIRECT_WITHOUT))
    expected = mitsuba_llvm("render_file", path=str(path), spp=SPP, seed=SEED)
    image = mlrt_plugin.render(path, spp=SPP, seed=SEED, shading="native").image
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-3)
    assert np.mean(np.abs(image - expected).max(axis=-1) > 1e-4 * scale) <= 0.001


@pytest.mark.filterwarnings("ignore:.*ellipsoid")
@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("material", MATERIALS)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, folder: Path, scale: str, material: str
) -> None:
    for plugin in PLUGINS:
        content = MATERIALS[material]
        body = mirrored(f'type="{plugin}">', scale, content)
        compare(mitsuba_llvm, folder / f"mirrored-{plugin}.xml", body)


@pytest.mark.parametrize("scale", SCALES)
def test_files_and_instances(mitsuba_llvm: MitsubaWorker, folder: Path, scale: str) -> None:
    texture_scenes.write_assets(folder)
    for file in ("quad.obj", "smooth.ply"):
        shape = f'type="{file[-3:]}"><string name="filename" value="{file}"/>'
        for content in MATERIALS.values():
            body = mirrored(shape, scale, content)
            compare(mitsuba_llvm, folder / "mirrored-file.xml", body)
    group = "".join(f'<shape type="{plugin}"/>' for plugin in ("rectangle", "sphere"))
    body = f'<shape type="shapegroup" id="group">{group}</shape>'
    body += mirrored('type="instance"><ref id="group"/>', scale, "")
    compare(mitsuba_llvm, folder / "mirrored-instance.xml", body)
