"""Memory of pictures that are dropped serves the next ones, but none that is held."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import scene_files

from mlrt_plugin._dispatch import core
from mlrt_plugin.options import AOVS
from mlrt_plugin.render import PreparedScene, prepare

SceneFile = Callable[..., Path]

SIDE = 704
"""A picture of that size is large enough to be kept, and all AOVs are not too much."""


def floor(scene_file: SceneFile, side: int) -> PreparedScene:
    """A floor that leaves most of the picture black."""
    prepared = prepare(scene_file(emitters=scene_files.LAMP), resolution=(side, side))
    assert isinstance(prepared, PreparedScene)
    return prepared


def address(picture: np.ndarray[Any, Any]) -> int:
    return int(picture.ctypes.data)


def test_nothing_is_left_of_an_earlier_picture(scene_file: SceneFile) -> None:
    prepared = floor(scene_file, SIDE)
    first = prepared.render(spp=2, aovs=AOVS)
    pictures = {"image": first.image, **first.aovs}
    expected = {name: picture.copy() for name, picture in pictures.items()}
    places = {name: (address(p), p.nbytes) for name, p in pictures.items()}
    for picture in pictures.values():
        picture.fill(np.nan if picture.dtype.kind == "f" else 12345)
    del first, pictures, picture
    second = prepared.render(spp=2, aovs=AOVS)
    # Pictures of the same number of bytes may change places.
    assert {(address(p), p.nbytes) for p in (second.image, *second.aovs.values())} == set(
        places.values()
    )
    for name, picture in {"image": second.image, **second.aovs}.items():
        np.testing.assert_array_equal(picture, expected[name], err_msg=name)


def test_pictures_that_are_held_are_not_written_to(scene_file: SceneFile) -> None:
    prepared = floor(scene_file, SIDE)
    held = [prepared.render(spp=1, seed=seed).image for seed in range(4)]
    # A view holds the picture as well.
    part = held[0][100:, ::3]
    copies = [image.copy() for image in held]
    expected = part.copy()
    del held[0]
    for seed in range(4, 8):
        prepared.render(spp=1, seed=seed).image.fill(-1)
    np.testing.assert_array_equal(part, expected)
    for image, copy in zip(held, copies[1:], strict=True):
        np.testing.assert_array_equal(image, copy)


def test_threads_that_render_at_once_share_no_picture(scene_file: SceneFile) -> None:
    prepared = floor(scene_file, SIDE)
    expected = [prepared.render(spp=1, seed=seed).image.copy() for seed in range(4)]

    def differs(seed: int) -> bool:
        return any(
            not np.array_equal(prepared.render(spp=1, seed=seed).image, expected[seed])
            for _ in range(8)
        )

    with ThreadPoolExecutor(4) as pool:
        assert not any(pool.map(differs, range(4)))


def test_no_more_is_kept_than_64_mib(scene_file: SceneFile) -> None:
    kept_bytes = core.render_selftest.kept_picture_bytes
    small = floor(scene_file, 1280)
    results = [small.render(spp=1) for _ in range(8)]
    of_one = results[0].image.nbytes
    del results
    assert kept_bytes() == 2**26 // of_one * of_one
    small.render(spp=1)
    assert kept_bytes() == 2**26 // of_one * of_one
    held = small.render(spp=1)
    assert kept_bytes() == (2**26 // of_one - 1) * of_one
    # Neither what is larger nor what is small takes its place.
    for side in (2560, 16):
        floor(scene_file, side).render(spp=1)
        assert kept_bytes() == (2**26 // of_one - 1) * of_one
    del held
