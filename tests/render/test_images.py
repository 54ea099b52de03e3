"""Whole pictures against Mitsuba's `direct` and `aov` with the same seed and samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import render_scenes
from core_scene import core_scene
from mitsuba_worker import MitsubaWorker

from mlrt_plugin._dispatch import core

SEED = 3
SPP = 5


def share_of_different_pixels(
    own: npt.NDArray[Any], reference: npt.NDArray[Any], tolerance: float
) -> float:
    assert own.shape == reference.shape
    scale = np.maximum(np.abs(reference).max(axis=-1), 1e-3)
    return float(np.mean(np.abs(own - reference).max(axis=-1) > tolerance * scale))


@pytest.mark.parametrize("name", render_scenes.SCENES)
def test_picture_equals_mitsubas(
    mitsuba_llvm: MitsubaWorker, folder: Path, name: str
) -> None:
    expected = mitsuba_llvm("render", scene=name, spp=SPP, seed=SEED)
    scene = core_scene(render_scenes.SCENES[name](folder))
    image = core.render(scene, SPP, SEED)["image"]
    assert image.dtype == np.float32
    assert np.mean(expected > 0) > 0.05
    # Mitsuba's barycentrics are in single precision, which shows in the slope of a fall-off
    # and at a light that is close to a curved surface; a pixel whose sample lies on an edge
    # may differ altogether.
    assert share_of_different_pixels(image, expected, 1e-4) < 0.012
    assert share_of_different_pixels(image, expected, 1e-3) < 0.001


@pytest.mark.parametrize("name", ["several", "mirrored", "large sky"])
def test_hidden_emitters(mitsuba_llvm: MitsubaWorker, folder: Path, name: str) -> None:
    expected = mitsuba_llvm("render", scene=name, spp=SPP, seed=SEED, hide_emitters=True)
    description = render_scenes.SCENES[name](folder)
    hidden = core.render(core_scene(description, hide_emitters=True), SPP, SEED)["image"]
    visible = core.render(core_scene(description), SPP, SEED)["image"]
    assert share_of_different_pixels(hidden, expected, 1e-3) < 0.001
    assert share_of_different_pixels(visible, expected, 1e-3) > 0.01


@pytest.mark.parametrize(
    "name", ["several", "crop", "offset camera", "lens", "parallel along an axis"]
)
def test_auxiliary_pictures(mitsuba_llvm: MitsubaWorker, folder: Path, name: str) -> None:
    expected = mitsuba_llvm(
        "render", scene=name, spp=SPP, seed=SEED, aovs="depth:depth,normal:sh_normal"
    )[..., -4:]
    scene = core_scene(render_scenes.SCENES[name](folder))
    aovs = core.render(scene, SPP, SEED, {}, ["depth", "normal", "prim"])["aovs"]
    own = np.concatenate([aovs["depth"][..., None], aovs["normal"]], axis=-1)
    assert share_of_different_pixels(own, expected, 1e-4) < 0.001
    missed = aovs["prim"] == -1
    assert (np.mean(missed) > 0.2) == (name in ("offset camera", "parallel along an axis"))
    # A pixel all of whose samples missed has no depth.
    assert np.all(aovs["prim"][expected[..., 0] == 0] == -1)


def test_primitive_is_that_of_the_first_sample(folder: Path) -> None:
    scene = core_scene(render_scenes.SCENES["point"](folder))
    # Another number of samples means other streams, so faces can differ, but at edges only.
    one = core.render(scene, 1, SEED, {}, ["prim"])["aovs"]["prim"]
    many = core.render(scene, 3, SEED, {}, ["prim"])["aovs"]["prim"]
    assert one.dtype == np.int32
    assert np.mean(one == many) > 0.8
