"""Area lights that show textures, against Mitsuba's `direct` with the same numbers."""

from __future__ import annotations

from pathlib import Path

import light_textures
import numpy as np
import pytest
import texture_scenes
from mitsuba_worker import MitsubaWorker

import mlrt_plugin
from mlrt_plugin.scene_arrays import Lighting

SEED, SPP = 5, 4
ROUNDING = 1e-4
STEPS = {"nearest": 0.01, "grey": 0.01, "checkerboard": 0.01, "nested checkerboard": 0.01}
"""Shares of pixels that may differ altogether where a texture has steps, which samples meet
to within rounding; else a few at edges of triangles and shadows."""


@pytest.fixture(scope="session")
def assets(folder: Path) -> Path:
    texture_scenes.write_assets(folder)
    return folder


def scene_path(folder: Path, name: str) -> Path:
    path = folder / f"light-{name.replace(' ', '-')}.xml"
    path.write_text(light_textures.SCENES[name])
    return path


@pytest.mark.parametrize("bsdf_samples", [0, 1])
@pytest.mark.parametrize("name", light_textures.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, assets: Path, name: str, bsdf_samples: int
) -> None:
    """With BSDF samples, how likely a point of the texture is counts too."""
    path = scene_path(assets, name)
    expected = mitsuba_llvm(
        "render_file", path=str(path), spp=SPP, seed=SEED, bsdf_samples=bsdf_samples
    )
    lighting = Lighting(emitter_samples=1, bsdf_samples=bsdf_samples)
    prepared = mlrt_plugin.prepare(path, shading="native", lighting=lighting)
    result = prepared.render(spp=SPP, seed=SEED)
    assert expected.max() > 0.1
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-3)
    error = np.abs(result.image - expected).max(axis=-1)
    allowed = next((v for k, v in STEPS.items() if name.startswith(k)), 0.002)
    assert np.mean(error > ROUNDING * scale) <= allowed
