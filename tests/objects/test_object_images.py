"""Pictures of analytic shapes and instances against Mitsuba's, with the same seed."""

from __future__ import annotations

import numpy as np
import object_scenes
import pytest
from mitsuba_worker import MitsubaWorker

import mlrt_plugin

SEED, SPP = 3, 4


@pytest.mark.filterwarnings("ignore:.*ellipsoid")
@pytest.mark.parametrize("offset", ["mitsuba", "robust"])
@pytest.mark.parametrize("name", object_scenes.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, name: str, offset: str
) -> None:
    expected = mitsuba_llvm("render", scene=name, spp=SPP, seed=SEED)
    scene = object_scenes.SCENES[name]()
    image = mlrt_plugin.render(
        scene, spp=SPP, seed=SEED, shading="native", shadow_offset=offset
    ).image
    assert np.mean(expected > 0) > 0.05
    error = np.abs(image - expected).max(axis=-1)
    differs = error > 1e-3 * np.maximum(expected.max(axis=-1), 1e-3 * expected.mean())
    # Samples on silhouettes and borders of shadows, where rounding decides, or the offset.
    assert np.mean(differs) < (0.0005 if offset == "mitsuba" else 0.002)
    rmse = np.sqrt(np.mean(error[~differs] ** 2))
    assert rmse < 1e-4 * expected.mean()


def test_hidden_lights_are_passed(mitsuba_llvm: MitsubaWorker) -> None:
    for name in ("cylinder light", "disk light"):
        expected = mitsuba_llvm(
            "render", scene=name, spp=SPP, seed=SEED, hide_emitters=True
        )
        scene = object_scenes.SCENES[name]()
        for offset in ("mitsuba", "robust"):
            image = mlrt_plugin.render(
                scene, spp=SPP, seed=SEED, hide_emitters=True, shadow_offset=offset
            ).image
            error = np.abs(image - expected).max(axis=-1)
            assert np.mean(error > 1e-3 * np.maximum(expected.max(axis=-1), 1e-3)) < 0.001


def test_auxiliary_pictures(mitsuba_llvm: MitsubaWorker) -> None:
    expected = mitsuba_llvm(
        "render", scene="instances", spp=SPP, seed=SEED, aovs="d:depth,n:sh_normal"
    )[..., -4:]
    scene = object_scenes.SCENES["instances"]()
    aovs = mlrt_plugin.render(
        scene, spp=SPP, seed=SEED, aovs=("depth", "normal", "prim", "cost")
    ).aovs
    own = np.concatenate([aovs["depth"][..., None], aovs["normal"]], axis=-1)
    error = np.abs(own - expected).max(axis=-1)
    assert np.mean(error > 1e-4 * np.abs(expected).max(axis=-1)) < 0.001
    # The floor has faces 0 and 1, the cube of the group those up to 13, then the sphere.
    assert {0, 14} < set(np.unique(aovs["prim"]).tolist()) <= set(range(-1, 15))
    assert aovs["cost"].max() > 1


def test_picture_depends_neither_on_traversal_nor_on_threads() -> None:
    scene = mlrt_plugin.prepare(object_scenes.instances())
    expected = scene.render(seed=SEED).image
    for traversal in ("single", "packet", "brute_force"):
        image = scene.render(seed=SEED, traversal=traversal, initial_tile=16).image
        np.testing.assert_array_equal(image, expected)
    one = mlrt_plugin.render(object_scenes.instances(), seed=SEED, threads=1).image
    np.testing.assert_array_equal(one, expected)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_robust_shadows_do_not_depend_on_scale(scale: float) -> None:
    """Power-free scales of a scene of round shapes: the same picture but for rounding."""

    def scaled(by: float) -> object_scenes.Scene:
        move = object_scenes.moved
        look = move().look_at([0, 2 * by, 6 * by], [0, 0.6 * by, 0], [0, 1, 0])
        ball = {"type": "sphere", "center": [0, 0.6 * by, 0], "radius": 0.5 * by}
        tube = {"type": "cylinder", "p0": [by, 0.2 * by, 0], "p1": [by, by, by]}
        parts = object_scenes.scene(
            ball={**ball, "bsdf": object_scenes.RED},
            tube={**tube, "radius": 0.2 * by, "bsdf": object_scenes.BLUE},
            floor={
                "type": "disk",
                "to_world": move().scale(by).rotate([1, 0, 0], -90).scale(4),
                "bsdf": object_scenes.BLUE,
            },
            light=object_scenes.SUN,
        )
        parts["sensor"] |= {"to_world": look, "near_clip": by / 100, "far_clip": 1e3 * by}
        return parts

    expected = mlrt_plugin.render(scaled(1), seed=SEED, shadow_offset="robust").image
    image = mlrt_plugin.render(scaled(scale), seed=SEED, shadow_offset="robust").image
    error = np.abs(image - expected).max(axis=-1)
    assert np.mean(expected == 0) > 0.1 and np.mean(expected > 0) > 0.1
    assert np.mean(error > 1e-3 * expected.max()) < 0.002
