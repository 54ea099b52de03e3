"""Verdicts that can fail: renders that are wrong in one way each are caught by the metric
that is there for it, and honest ones pass at 99 % confidence.

Two judges: the same noise (MLRT against Mitsuba's llvm variant with the same random
numbers) and expected values (the z-test against Mitsuba's scalar variant).
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import exr_images
import numpy as np
import OpenEXR
import pytest
import repository
from mlrt_compare.cli import main
from mlrt_compare.reference_cache import ReferenceCache
from mlrt_compare.scalar_reference import Reference, rendered_reference, to_xyz
from mlrt_compare.settings import Settings
from mlrt_compare.ztest import ZTest, z_test

import mlrt_plugin

SCENE = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"
SIDE = 96
SPP = 256
FILL = '<rgb name="intensity" value="170000, 158000, 140000"/>'
WEAKER_FILL = '<rgb name="intensity" value="136000, 126400, 112000"/>'
"""Four fifths of it."""


def shifted(image: np.ndarray) -> np.ndarray:
    return np.roll(image, 1, axis=1)


def darker(image: np.ndarray) -> np.ndarray:
    return image * np.float32(0.99)


def swapped(image: np.ndarray) -> np.ndarray:
    return image[..., ::-1]


def leaking(image: np.ndarray) -> np.ndarray:
    """20 pixels along a diagonal see the light behind a wall."""
    leaked = image.copy()
    places = np.linspace(10, len(image) - 10, 20).astype(int)
    leaked[places, places] = 1.5
    return leaked


def honest(image: np.ndarray) -> np.ndarray:
    return image


def wrong_light(folder: Path) -> Path:
    """The scene with a weaker light in front of the box."""
    text = SCENE.read_text()
    assert text.count(FILL) == 1
    path = folder / "weaker.xml"
    path.write_text(text.replace(FILL, WEAKER_FILL))
    return path


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[np.ndarray, Path]:
    """MLRT's image, and the file of Mitsuba's with the same noise."""
    folder = tmp_path_factory.mktemp("pair")
    child = subprocess.run(
        [
            *(sys.executable, "-P", "-m", "mlrt_compare", str(SCENE), "-o", str(folder)),
            *("--spp", "16", "--resolution", "256x256", "--rounds", "1"),
        ],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert child.returncode == 0, child.stdout + child.stderr
    with OpenEXR.File(str(folder / "cornell-box-mlrt.exr")) as file:
        image = np.array(file.channels()["RGB"].pixels)
    return image, folder / "cornell-box-mitsuba.exr"


SAME_NOISE: dict[str, tuple[str, ...]] = {
    "shifted": ("--fail-if", "ssim=0.99"),
    "darker": ("--fail-if", "energy=0.001"),
    "swapped": ("--fail-if", "smape=0.001"),
    "wrong light": ("--fail-if", "relmse=0.0001"),
    # 20 of 65536 pixels are 0.03 %, far below what means can show.
    "leaking": ("--fail", "0.01", "--failpercent", "0.01", "--warn", "1"),
}
ALTERED: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "shifted": shifted,
    "darker": darker,
    "swapped": swapped,
    "leaking": leaking,
}


@pytest.mark.parametrize("defect", SAME_NOISE)
def test_the_same_noise_shows_each_defect_in_its_metric(
    tmp_path: Path, pair: tuple[np.ndarray, Path], defect: str
) -> None:
    image, reference = pair
    if defect == "wrong light":
        bad = mlrt_plugin.render(
            wrong_light(tmp_path), spp=16, resolution=image.shape[1::-1]
        ).image
    else:
        bad = ALTERED[defect](image)
    options = SAME_NOISE[defect]
    for name, picture, code in (("right", image, 0), ("wrong", bad, 2)):
        path = exr_images.write_exr(tmp_path / f"{name}.exr", picture)
        assert main(["image", str(path), str(reference), *options]) == code, name


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> Reference:
    cache = ReferenceCache(tmp_path_factory.mktemp("references"))
    return rendered_reference(Settings(SCENE, resolution=(SIDE, SIDE)), 2048, cache)


def judged(image: np.ndarray, reference: Reference) -> ZTest:
    return z_test(
        to_xyz(image),
        reference.mean,
        reference.variance,
        SPP,
        reference_spp=reference.spp,
    )


def rendered(seed: int, scene: Path = SCENE) -> np.ndarray:
    return mlrt_plugin.render(scene, spp=SPP, seed=seed, resolution=(SIDE, SIDE)).image


def test_honest_images_pass_at_99_per_cent(reference: Reference) -> None:
    tests = [judged(rendered(seed), reference) for seed in range(12)]
    assert all(test.pixels_pass for test in tests)
    # Each passes with a probability of 99 %; three failures of 12 have one of 2e-4.
    assert sum(not test.mean_passes for test in tests) < 3


@pytest.mark.parametrize("defect", [shifted, swapped, leaking])
def test_pixels_show_what_is_wrong_in_places(
    reference: Reference, defect: Callable[[np.ndarray], np.ndarray]
) -> None:
    # Of 9216 pixels 20 are 0.22 %, and Mitsuba's rule forgives 0.25 %: a corner of the
    # image, in which they are more, is judged by itself.
    part = np.s_[: SIDE // 2, : SIDE // 2] if defect is leaking else np.s_[:, :]
    image = rendered(1)
    corner = Reference(
        reference.mean[part], reference.variance[part], reference.spp, reference.source
    )
    assert judged(image[part], corner).pixels_pass
    bad = leaking(image[part]) if defect is leaking else defect(image)
    assert not judged(bad, corner).pixels_pass


def test_mean_shows_a_loss_of_one_per_cent(reference: Reference) -> None:
    image = rendered(1)
    assert judged(image, reference).mean_passes
    test = judged(darker(image), reference)
    assert not test.mean_passes and max(test.mean_z) < 0


def test_one_wrong_light_is_found(reference: Reference, tmp_path: Path) -> None:
    test = judged(rendered(3, wrong_light(tmp_path)), reference)
    assert not test.pixels_pass and not test.mean_passes
