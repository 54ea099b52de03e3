"""Emitter samples and shadow offsets against Mitsuba's scene and interaction."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import render_scenes
from core_scene import core_scene

from mlrt_plugin._dispatch import core

LIT = [
    *("point", "spot", "directional", "rectangle", "mesh smooth", "mesh flat", "several"),
    *("constant", "sky", "large sky", "mirrored sky"),
]


@pytest.mark.parametrize("name", [*LIT, "mirrored"])
def test_samples_equal_those_of_the_scene(folder: Path, name: str) -> None:
    description = render_scenes.SCENES[name](folder)
    theirs = mi.load_dict(description, optimize=False)
    own = core_scene(description)
    random = np.random.default_rng(17)
    interaction = mi.SurfaceInteraction3f()
    lit = unlit = 0
    within, share = (2e-5, 1e-3) if "sky" in name else (3e-6, 2e-4)
    for _ in range(400):
        p = random.uniform([-1.5, 0, -1.5], [1.5, 1.5, 2]).astype(np.float32)
        x, y = random.random(2).astype(np.float32)
        interaction.p = p
        ds, spectrum = theirs.sample_emitter_direction(interaction, [x, y], False)
        weight = np.array(spectrum)
        sample = core.render_selftest.sample_emitter(own, p, x, y)
        # Absolutely too: cosines and the angle of a fall-off are differences; the choice
        # of a face, or of a part of the sky, magnifies the rounding of what is left of a
        # random number, and hence of the direction.
        np.testing.assert_allclose(sample["weight"], weight, rtol=share, atol=1e-4)
        if not weight.any():
            unlit += 1
            continue
        lit += 1
        assert theirs.emitters()[sample["emitter"]] == ds.emitter
        np.testing.assert_allclose(sample["direction"], np.array(ds.d), atol=within)
        target_within = within * max(3, ds.dist)
        np.testing.assert_allclose(sample["target"], np.array(ds.p), atol=target_within)
    assert lit > 50
    assert unlit > 50 or name not in ("spot", "mesh smooth", "mesh flat")


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_shadow_rays_begin_and_end_where_mitsubas_do(size: float) -> None:
    random = np.random.default_rng(23)
    interaction = mi.SurfaceInteraction3f()
    for _ in range(200):
        p, target = (size * random.normal(size=(2, 3))).astype(np.float32)
        normal = random.normal(size=3)
        normal = (normal / np.linalg.norm(normal)).astype(np.float32)
        interaction.p, interaction.n = p, normal
        ray = interaction.spawn_ray_to(target)
        start = np.array(core.render_selftest.offset_point(p, normal, target - p))
        np.testing.assert_allclose(start, np.array(ray.o), rtol=1e-6, atol=1e-7 * size)
        length = np.linalg.norm(target - start)
        share = 1 - core.render_selftest.SHADOW_EPSILON
        assert share * length == pytest.approx(ray.maxt, rel=1e-6)


def test_an_emitter_without_weight_is_never_chosen(folder: Path) -> None:
    dark = render_scenes.point_light() | {"sampling_weight": 0.0}
    description = render_scenes.room(
        folder, a=dark, b=render_scenes.point_light(), c=dict(dark)
    )
    own = core_scene(description)
    for x in np.linspace(0, np.nextafter(np.float32(1), np.float32(0)), 33):
        sample = core.render_selftest.sample_emitter(own, [0, 0.5, 0], x, 0.5)
        assert sample["emitter"] == 1
