"""MLRT's image is Mitsuba's: mlrt-compare passes on every scene that is at hand."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

OWN = Path(__file__).resolve().parents[2] / "scenes"
SPP, RESOLUTION = 2, "128x128"

OWN_SCENES = {
    "cornell-box": ("cornell-box/cornell-box.xml", {}),
    "cornell-box, gaussian": ("cornell-box/cornell-box.xml", {"rfilter": "gaussian"}),
    "office": ("office/office.xml", {}),
    "office, gaussian": ("office/office.xml", {"rfilter": "gaussian"}),
}
SHARED_SCENES = (
    "conference/conference.xml",
    "sponza/sponza.xml",
    "bunny/bunny.xml",
    "toasters/toasters.xml",
    "dragon/dragon.xml",
    "living-room/scene_direct.xml",
)


BY_MITSUBA = (
    "living-room/scene.xml",
    "mitsuba-data/tests/scenes/various_shapes/test_various_shapes_path.xml",
    "mitsuba-tutorials/cbox.xml",
)
"""Scenes with plugins that are not native."""


def assert_parity(
    scene: Path, folder: Path, defines: dict[str, str], shading: str = "auto"
) -> None:
    figures = folder / "figures.json"
    arguments = [
        str(scene),
        *("--spp", str(SPP), "--resolution", RESOLUTION, "--seed", "7", "--rounds", "1"),
        *("-o", str(folder), "--json", str(figures), "--shading", shading),
        *(f"-D{key}={value}" for key, value in defines.items()),
    ]
    child = subprocess.run(
        # -P: the checkout holds mlrt_plugin without its native core.
        [sys.executable, "-P", "-m", "mlrt_compare", *arguments],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert child.returncode == 0, child.stdout + child.stderr
    result = json.loads(figures.read_text())
    assert result["passed"]
    assert shading == "auto" or result["shading"].startswith(shading)


@pytest.mark.parametrize("name", OWN_SCENES)
def test_scene_of_the_project(tmp_path: Path, name: str) -> None:
    scene, defines = OWN_SCENES[name]
    assert_parity(OWN / scene, tmp_path, defines)


@pytest.mark.parametrize("name", SHARED_SCENES)
def test_scene_beside_the_checkout(
    tmp_path: Path, shared_scene: Callable[[str], Path], name: str
) -> None:
    assert_parity(shared_scene(name), tmp_path, {})


@pytest.mark.parametrize("name", OWN_SCENES)
def test_scene_of_the_project_shaded_by_mitsuba(tmp_path: Path, name: str) -> None:
    scene, defines = OWN_SCENES[name]
    assert_parity(OWN / scene, tmp_path, defines, "mitsuba")


@pytest.mark.parametrize("name", BY_MITSUBA)
def test_scene_beside_the_checkout_shaded_by_mitsuba(
    tmp_path: Path, shared_scene: Callable[[str], Path], name: str
) -> None:
    assert_parity(shared_scene(name), tmp_path, {}, "mitsuba")
