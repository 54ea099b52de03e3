"""Textured and masked materials against Mitsuba's `direct` with the same random numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import texture_scenes
from mitsuba_worker import MitsubaWorker

from mlrt_plugin import prepare

SEED = 5
SPP = 4
ROUNDING = 1e-4
"""Of the larger value: textures turn the rounding of barycentrics into that of colours."""
EDGES = {"nearest": 0.01, "checkerboard": 0.01, "two sides": 0.01}
"""Shares of pixels that may differ altogether, where a texture has steps that samples meet
to within rounding; else one in a thousand, at edges of triangles."""


@pytest.fixture(scope="session")
def assets(folder: Path) -> Path:
    texture_scenes.write_assets(folder)
    return folder


@pytest.mark.parametrize("name", texture_scenes.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, assets: Path, name: str
) -> None:
    path = assets / f"{name.replace(' ', '-')}.xml"
    path.write_text(texture_scenes.SCENES[name])
    expected = mitsuba_llvm("render_file", path=str(path), spp=SPP, seed=SEED)
    prepared = prepare(path, shading="native")
    image = prepared.render(spp=SPP, seed=SEED).image
    assert image.shape == expected.shape
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-3)
    error = np.abs(image - expected).max(axis=-1)
    allowed = next((v for k, v in EDGES.items() if name.startswith(k)), 0.001)
    assert np.mean(error > ROUNDING * scale) <= allowed
