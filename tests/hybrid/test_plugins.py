"""Each plugin of Mitsuba on our hits gives the image of Mitsuba's own `direct`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plugin_scenes
import pytest
from mlrt_compare.metrics import differing_mask
from mlrt_compare.mitsuba_renderer import MitsubaRenderer
from mlrt_compare.settings import Settings

from mlrt_plugin import prepare
from mlrt_plugin.coverage import coverage_rows
from mlrt_plugin.scene_import import summarise

SEED = 11
ROUNDING = 1e-5
"""Of the mean; films are summed up in another order."""
UNTESTED = {
    ("shape", "blender"): "it takes addresses in Blender's memory",
    ("bsdf", "measured"): "it needs measurements, which are not free",
    ("bsdf", "measured_polarized"): "it needs measurements, which are not free",
}


def scene_path(folder: Path, name: str) -> Path:
    path = folder / f"{name.replace(' ', '-')}.xml"
    path.write_text(plugin_scenes.SCENES[name])
    return path


@pytest.mark.parametrize("name", plugin_scenes.SCENES)
def test_image_is_that_of_direct(assets: Path, name: str) -> None:
    path = scene_path(assets, name)
    prepared = prepare(path, shading="mitsuba")
    image = prepared.render(seed=SEED).image
    reference = MitsubaRenderer(
        Settings(path, seed=SEED),
        {"type": "direct", "emitter_samples": 1, "bsdf_samples": 1},
    )
    reference.frame()
    assert image.shape == reference.image.shape and image.max() > 0
    # Where a ray grazes an edge, Embree and the exact test may decide in different ways.
    differing = differing_mask(image, reference.image)
    assert np.count_nonzero(differing) <= max(2, differing.size // 1000)
    same = ~differing
    error = np.sqrt(np.mean((image - reference.image)[same] ** 2))
    assert error < ROUNDING * reference.image.mean()


def test_all_plugins_have_a_scene(assets: Path) -> None:
    tested = set()
    for name in plugin_scenes.SCENES:
        summary = summarise(scene_path(assets, name))
        tested |= {(f.kind, f.plugin) for f in summary.features}
    expected = {
        (row.kind, row.plugin)
        for row in coverage_rows()
        if row.kind not in ("integrator", "phase function")
        and row.verdict in ("native", "by Mitsuba")
    }
    assert expected - tested - set(UNTESTED) == set()
