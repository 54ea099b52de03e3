"""Lights in mirrors and glass, against Mitsuba's `direct` with the same numbers."""

from __future__ import annotations

from pathlib import Path

import mirror_scenes
import numpy as np
import pytest
from mitsuba_worker import MitsubaWorker

import mlrt_plugin
from mlrt_plugin.errors import SceneError
from mlrt_plugin.scene_arrays import Lighting

SEED, SPP = 5, 4
ROUNDING = 1e-4
EDGES = 0.004
"""Share of the pixels that may differ: at edges of triangles, of lights in mirrors, and
where a random number is that which is reflected, to within rounding; and in glass with the
sampler `stratified`, see docs/coverage.md."""


def scene_path(folder: Path, name: str) -> Path:
    path = folder / f"mirrors-{name.replace(' ', '-')}.xml"
    path.write_text(mirror_scenes.SCENES[name])
    return path


COUNTS = {"metals": (0, 2), "masks": (2, 1), "light in glass": (1, 3)}
"""Samples of emitters and of BSDFs, where they are not one of each."""


@pytest.mark.parametrize("name", mirror_scenes.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, tmp_path: Path, name: str
) -> None:
    path = scene_path(tmp_path, name)
    lights, bsdfs = COUNTS.get(name, (1, 1))
    expected = mitsuba_llvm(
        "render_file",
        path=str(path),
        spp=SPP,
        seed=SEED,
        emitter_samples=lights,
        bsdf_samples=bsdfs,
    )
    lighting = Lighting(emitter_samples=lights, bsdf_samples=bsdfs)
    assert mlrt_plugin.prepare(path, lighting=lighting).shading.path == "native"
    result = mlrt_plugin.prepare(path, lighting=lighting).render(spp=SPP, seed=SEED)
    without = Lighting(emitter_samples=max(lights, 1), bsdf_samples=0)
    dark = mlrt_plugin.prepare(path, lighting=without).render(spp=SPP, seed=SEED)
    assert np.mean(expected > dark.image + 0.01) > 0.005, "mirrors show something"
    scale = np.maximum(np.abs(expected).max(axis=-1), 1e-2)
    error = np.abs(result.image - expected).max(axis=-1)
    assert np.mean(error > ROUNDING * scale) <= EDGES


def test_a_perfect_mirror_shows_the_radiance(tmp_path: Path) -> None:
    """Without Mitsuba: what reflects all shows the sky as it is, from every side."""
    path = tmp_path / "mirror.xml"
    path.write_text(
        mirror_scenes.scene(
            mirror_scenes.block(mirror_scenes.bsdf("conductor"), 0, "sphere", 1.0),
            mirror_scenes.SKY,
            floor="",
        )
    )
    lighting = Lighting(emitter_samples=0, bsdf_samples=1)
    image = mlrt_plugin.prepare(path, lighting=lighting).render(spp=2).image
    assert np.abs(image / np.float32([0.3, 0.4, 0.6]) - 1).max() < 1e-5


def test_glass_without_a_positive_index_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "glass.xml"
    glass = mirror_scenes.bsdf("dielectric", mirror_scenes.number("int_ior", 0.0))
    path.write_text(mirror_scenes.scene(mirror_scenes.block(glass), mirror_scenes.SKY))
    with pytest.raises(SceneError, match=r"index of refraction"):
        mlrt_plugin.prepare(path, lighting=Lighting(emitter_samples=1, bsdf_samples=1))
