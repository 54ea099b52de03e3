"""Area lights that show textures, against Mitsuba's `direct` with the same numbers."""

from __future__ import annotations

from pathlib import Path

import light_textures
import numpy as np
import pytest
import texture_scenes
from mitsuba_worker import MitsubaWorker

import mlrt_plugin

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


@pytest.mark.parametrize("name", light_textures.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, assets: Path, name: str
) -> None:
    path = scene_path(assets, name)
    expected = mitsuba_llvm("render_file", path=str(path), spp=SPP, seed=SEED)
    result = mlrt_plugin.render(path, spp=SPP, seed=SEED, shading="native")
    assert expected.max() > 0.1
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-3)
    error = np.abs(result.image - expected).max(axis=-1)
    allowed = next((v for k, v in STEPS.items() if name.startswith(k)), 0.002)
    assert np.mean(error > ROUNDING * scale) <= allowed
