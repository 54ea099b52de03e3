"""Textured and masked materials against Mitsuba's `direct` with the same random numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import texture_scenes
from mitsuba_worker import MitsubaWorker

from mlrt_plugin import import_scene, prepare
from mlrt_plugin.texture_arrays import BitmapTexture

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


def share_of_different_pixels(
    mitsuba_llvm: MitsubaWorker, path: Path, bsdf_samples: int, rounding: float = ROUNDING
) -> float:
    """Of the native picture and Mitsuba's, beyond rounding."""
    expected = mitsuba_llvm(
        "render_file", path=str(path), spp=SPP, seed=SEED, bsdf_samples=bsdf_samples
    )
    image = prepare(path, shading="native").render(spp=SPP, seed=SEED).image
    assert image.shape == expected.shape and expected.max() > 0
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-3)
    error = np.abs(image - expected).max(axis=-1)
    return float(np.mean(error > rounding * scale))


def scene_path(folder: Path, name: str) -> Path:
    path = folder / f"{name.replace(' ', '-')}.xml"
    path.write_text(texture_scenes.SCENES[name])
    return path


@pytest.mark.parametrize("name", texture_scenes.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, assets: Path, name: str
) -> None:
    allowed = next((v for k, v in EDGES.items() if name.startswith(k)), 0.001)
    assert share_of_different_pixels(mitsuba_llvm, scene_path(assets, name), 1) <= allowed


@pytest.mark.parametrize("name", ["masks", "black materials"])
def test_bsdf_samples_find_no_lamps(
    mitsuba_llvm: MitsubaWorker, assets: Path, name: str
) -> None:
    assert share_of_different_pixels(mitsuba_llvm, scene_path(assets, name), 1) <= 0.001


def test_photographs(
    mitsuba_llvm: MitsubaWorker, tmp_path: Path, shared_scene: Callable[[str], Path]
) -> None:
    path = tmp_path / "living-room.xml"
    original = shared_scene("living-room/scene.xml")
    path.write_text(texture_scenes.matte_living_room(original))
    bitmaps = [t for t in import_scene(path).textures if isinstance(t, BitmapTexture)]
    assert len(bitmaps) == 5 and max(bitmap.width for bitmap in bitmaps) > 500
    # Neighbouring pixels of a large photograph are close to each other, and differ much.
    assert share_of_different_pixels(mitsuba_llvm, path, 0, 10 * ROUNDING) <= 0.001


@pytest.mark.parametrize(
    "name", ["bilinear repeat", "nearest mirror", "images", "attributes", "masks"]
)
def test_textures_make_a_difference(assets: Path, name: str) -> None:
    """Without them the comparison above would fail, so it is not one of blank surfaces."""
    arrays = import_scene(scene_path(assets, name))
    plain = dataclasses.replace(arrays, textures=(), material_textures=None)
    images = [prepare(a).render(spp=SPP, seed=SEED).image for a in (arrays, plain)]
    scale = np.maximum(images[0].max(axis=-1), 1e-3)
    error = np.abs(images[1] - images[0]).max(axis=-1)
    assert np.mean(error > 100 * ROUNDING * scale) > 0.02
