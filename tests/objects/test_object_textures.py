"""Textures on analytic shapes and in instances, against Mitsuba's `direct` with the same
random numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import object_textures
import pytest
import texture_scenes
from mitsuba_worker import MitsubaWorker

import mlrt_plugin

SEED, SPP = 5, 4


@pytest.fixture(scope="module")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("object-textures")
    texture_scenes.write_assets(folder)
    return folder


@pytest.mark.filterwarnings("ignore:.*no texture coordinates")
@pytest.mark.parametrize("name", object_textures.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, assets: Path, name: str
) -> None:
    path = assets / f"{name.replace(' ', '-')}.xml"
    path.write_text(object_textures.SCENES[name])
    expected = mitsuba_llvm(
        "render_file", path=str(path), spp=SPP, seed=SEED, bsdf_samples=1
    )
    prepared = mlrt_plugin.prepare(path)
    assert prepared.shading.path == "native"
    image = prepared.render(spp=SPP, seed=SEED).image
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-3)
    error = np.abs(image - expected).max(axis=-1)
    # Mitsuba finds angles in single precision, and textures have steps and slopes.
    assert np.mean(error > 1e-3 * scale) <= 0.002
    assert np.sqrt(np.mean(error**2)) < 1e-3 * expected.mean()
