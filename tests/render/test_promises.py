"""What a picture may not depend on, and how a long one reports and ends."""

from __future__ import annotations

import itertools
import signal
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import drjit as dr
import numpy as np
import pytest
import render_scenes
from core_scene import core_scene

from mlrt_plugin._dispatch import core

AOVS = ["depth", "normal", "prim"]


@pytest.fixture
def threads() -> Iterator[None]:
    count = dr.thread_count()
    yield
    dr.set_thread_count(count)


def all_pictures(answer: dict[str, Any]) -> bytes:
    return b"".join(
        np.ascontiguousarray(picture).tobytes()
        for picture in [answer["image"], *(answer["aovs"][name] for name in AOVS)]
    )


@pytest.mark.parametrize(
    "name", ["several", "gaussian border", "crop", "mirrored sky", "lens", "parallel"]
)
def test_picture_does_not_depend_on_threads(folder: Path, threads: None, name: str) -> None:
    scene = core_scene(render_scenes.SCENES[name](folder))
    pictures = set()
    for count in (1, 2, 5):
        dr.set_thread_count(count)
        pictures.add(all_pictures(core.render(scene, 3, 1, {}, AOVS)))
    assert len(pictures) == 1


@pytest.mark.parametrize(
    "name", ["several", "gaussian border", "crop", "mirrored sky", "lens", "parallel"]
)
def test_picture_does_not_depend_on_options(folder: Path, name: str) -> None:
    scene = core_scene(render_scenes.SCENES[name](folder))
    pictures = {}
    for traversal, entry_points, (initial, minimum), split in itertools.product(
        ["brute_force", "single", "packet", "interval"],
        [False, True],
        [(1, 1), (8, 4), (64, 16), (256, 16)],
        [4, 16],
    ):
        options = {
            "traversal": traversal,
            "entry_points": entry_points,
            "initial_tile": initial,
            "minimum_tile": minimum,
            "split_factor": split,
        }
        pictures[str(options)] = all_pictures(core.render(scene, 3, 1, options, AOVS))
    assert len(set(pictures.values())) == 1


@pytest.mark.parametrize("samples", [1, 4, 6, 16, 20])
def test_picture_does_not_depend_on_groups(folder: Path, samples: int) -> None:
    # Whole pixels are summed side by side where they fill squares, else one by one, and
    # in parts if a tile holds less than a pixel's samples.
    scene = core_scene(render_scenes.SCENES["several"](folder))
    pictures = [
        all_pictures(core.render(scene, samples, 1, {"initial_tile": tile}, AOVS))
        for tile in (1, 2, 4, 16, 64, 128)
    ]
    assert len(set(pictures)) == 1


@pytest.mark.parametrize("name", ["several", "gaussian border", "crop", "mirrored sky"])
@pytest.mark.parametrize("samples", [1, 4, 16])
def test_beams_bounded_by_the_film_leave_the_picture_as_it_is(
    folder: Path, name: str, samples: int
) -> None:
    """They are made for powers of two of samples; the near plane cuts the scene."""
    description = render_scenes.SCENES[name](folder)
    description["sensor"]["near_clip"] = 3.9
    scene = core_scene(description)
    pictures = set()
    for traversal, entry_points in (
        ("brute_force", False),
        ("beam_leaf", False),
        ("beam_leaf", True),
        ("adaptive", True),
    ):
        options = {"traversal": traversal, "entry_points": entry_points}
        answer = core.render(scene, samples, 1, options, AOVS)
        assert (answer["counters"]["primary_beams"] > 0) == (traversal != "brute_force")
        pictures.add(all_pictures(answer))
    assert len(pictures) == 1


def test_pictures_depend_on_the_seed(folder: Path) -> None:
    scene = core_scene(render_scenes.SCENES["rectangle"](folder))
    first, again, other = (core.render(scene, 2, seed)["image"] for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert np.mean(first != other) > 0.5


def test_every_ray_is_counted(folder: Path) -> None:
    scene = core_scene(render_scenes.SCENES["point"](folder))
    counters = core.render(scene, 3)["counters"]
    assert counters["primary_rays"] == 64 * 48 * 3
    assert 0 < counters["shadow_rays"] < 64 * 48 * 3


def test_black_and_unlit_points_send_no_shadow_rays(folder: Path) -> None:
    description = render_scenes.room(folder, light=render_scenes.point_light())
    for child in ("floor", "wall", "cube", "ball"):
        description[child]["bsdf"] = render_scenes.diffuse(0, 0, 0)
    answer = core.render(core_scene(description), 1)
    assert answer["counters"]["shadow_rays"] == 0
    assert not answer["image"].any()


def test_progress_grows(folder: Path) -> None:
    scene = core_scene(render_scenes.SCENES["point"](folder))
    # Reports come about ten times a second: the picture must take a while on any machine.
    seen: list[float] = []
    for doubling in range(12):
        seen.clear()
        core.render(scene, 1000 << doubling, 0, {}, [], seen.append)
        if len(seen) > 2:
            break
    assert len(seen) > 2
    assert seen == sorted(seen)
    assert min(seen) >= 0 and max(seen) <= 1


def test_an_exception_in_progress_ends_the_picture(folder: Path) -> None:
    def progress(done: float) -> None:
        raise LookupError(f"enough at {done}")

    scene = core_scene(render_scenes.SCENES["point"](folder))
    with pytest.raises(LookupError, match="enough at"):
        core.render(scene, 100_000, 0, {}, [], progress)


def test_a_signal_ends_the_picture(folder: Path) -> None:
    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    scene = core_scene(render_scenes.SCENES["point"](folder))
    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        with pytest.raises(KeyboardInterrupt):
            core.render(scene, 100_000)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
