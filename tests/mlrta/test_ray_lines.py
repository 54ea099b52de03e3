"""Rays that come line by line of an image are taken in squares, by counting; whether they
do is a guess, and no answer may depend on it."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import Options, beam_steps, build, closest, each_core, occluded

SEED = 20261129
PACKETS: Options = {"traversal": "packet"}
ADAPTIVE: Options = {"traversal": "adaptive"}
ORIGIN = np.array([0.5, 0.5, -2.5], np.float32)

Directions = npt.NDArray[np.float32]


def image(width: int, height: int, samples: int = 1) -> Directions:
    """Of a camera with a wide field of view, of unit length and jittered, as (height, width
    * samples, 3)."""
    rng = np.random.default_rng(SEED)
    shape = (height, width, samples)
    x = np.arange(width)[None, :, None] + rng.uniform(0, 1, shape)
    y = np.arange(height)[:, None, None] + rng.uniform(0, 1, shape)
    side = max(width, height)
    d = np.stack([2 * x / side - 1, 2 * y / side - 1, np.ones(shape)], axis=-1)
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    return d.reshape(height, width * samples, 3).astype(np.float32)


def rows(directions: npt.NDArray[Any]) -> Directions:
    return np.ascontiguousarray(directions.reshape(-1, 3), np.float32)


def with_holes() -> Directions:
    directions = rows(image(200, 90))
    directions[1_000::77] = np.nan
    directions[1_001::511] = np.inf
    directions[1_002::513] = 0
    return directions


def area_of(directions: Directions) -> float:
    """Around those that are directions."""
    regular = np.isfinite(directions).all(axis=1) & (directions != 0).any(axis=1)
    return float(np.prod(np.ptp(directions[regular, :2], axis=0)))


LINES = {
    "whole squares": rows(image(256, 128)),
    "odd sides": rows(image(131, 77)),
    "narrow": rows(image(33, 130)),
    "from below": rows(image(130, 70)[::-1]),
    "from right to left": rows(image(130, 70)[:, ::-1]),
    "column by column": rows(image(130, 70).transpose(1, 0, 2)),
    "cut within lines": rows(image(130, 70))[97:-45],
    "cut before the last of a line": rows(image(130, 70))[129:],
    "cut behind the first of a line": rows(image(130, 70))[1 : 69 * 130 + 1],
    "4 samples a pixel": rows(image(70, 70, 4)),
    "5 samples a pixel": rows(image(70, 70, 5)),
    "16 samples a pixel": rows(image(50, 40, 16)),
    "100 samples a pixel": rows(image(40, 40, 100))[5:],
    "two squares a tile": rows(image(400, 400)),
    "three squares a tile": rows(image(512, 384)),
    "three squares a tile, odd sides": rows(image(251, 799)),
    "three squares a tile, 4 samples a pixel": rows(image(240, 240, 4)),
    "three squares a tile, 100 samples a pixel": rows(image(45, 45, 100)),
    "four squares a tile": rows(image(600, 500)),
    "holes": with_holes(),
}


def shuffled() -> Directions:
    return np.random.default_rng(SEED).permutation(rows(image(256, 128)))


def in_morton_order() -> Directions:
    row, column = np.divmod(np.arange(1 << 14), 1 << 7)
    code = np.zeros_like(row)
    for bit in range(7):
        code |= (column >> bit & 1) << 2 * bit | (row >> bit & 1) << 2 * bit + 1
    return rows(rows(image(128, 128))[np.argsort(code)])


def back_and_forth() -> Directions:
    directions = image(130, 70)
    directions[1::2] = directions[1::2, ::-1]
    return rows(directions)


def shuffled_within_lines() -> Directions:
    rng = np.random.default_rng(SEED)
    return rows(rng.permuted(image(256, 128), axis=1))


def then_shuffled() -> Directions:
    """Lines only where they are looked for."""
    rng = np.random.default_rng(SEED)
    directions = rows(image(256, 512))
    directions[1 << 14 :] = rng.permutation(directions[1 << 14 :])
    return directions


OTHERS = {
    "shuffled": shuffled(),
    "Morton order": in_morton_order(),
    "back and forth": back_and_forth(),
    "shuffled within lines": shuffled_within_lines(),
    "then shuffled": then_shuffled(),
    "one line": rows(image(5_000, 1)),
    "three lines": rows(image(1_000, 3)),
    "few rays": rows(image(20, 20)),
    "no rays": rows(np.zeros((0, 3))),
    "one direction": np.tile(np.float32([0.01, 0.02, 1]), (5_000, 1)),
    "no numbers": np.full((5_000, 3), np.nan, np.float32),
    "infinite": np.full((5_000, 3), np.inf, np.float32),
}


def partly_shuffled() -> Directions:
    """Fewer rays than are noticed."""
    rng = np.random.default_rng(SEED)
    directions = image(512, 512)
    directions[64:84] = rng.permutation(directions[64:84].reshape(-1, 3)).reshape(
        20, 512, 3
    )
    return rows(directions)


FOOLED = {"partly shuffled": partly_shuffled()}


@each_core
@pytest.mark.parametrize("order", LINES)
def test_lines_are_taken_in_squares(core: ModuleType, order: str) -> None:
    directions = LINES[order]
    tiles = core.mlrta_selftest.image_tiles(directions)
    assert tiles is not None
    assert np.array_equal(np.sort(np.concatenate(tiles)), np.arange(len(directions)))
    # What beams of 256 rays cover, of all that is covered.
    areas = [
        area_of(directions[tile[i : i + 256]])
        for tile in map(np.asarray, tiles)
        for i in range(0, len(tile) - 255, 256)
    ]
    assert np.mean(areas) < 3 * 256 / len(directions) * area_of(directions)


@each_core
@pytest.mark.parametrize("order", OTHERS)
def test_other_orders_are_not_taken_for_lines(core: ModuleType, order: str) -> None:
    assert core.mlrta_selftest.image_tiles(OTHERS[order]) is None


@each_core
@pytest.mark.parametrize("order", LINES | OTHERS | FOOLED)
@pytest.mark.parametrize("lens", [0, 0.01])
def test_hits_are_those_of_packets(core: ModuleType, order: str, lens: float) -> None:
    """Packets take rays as they come."""
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.1))
    directions = (LINES | OTHERS | FOOLED)[order]
    origins = ORIGIN + lens * rng.uniform(-1, 1, directions.shape)
    rays = origins.astype(np.float32), directions
    t_max = rng.choice(np.array([np.inf, 2.7, 2.2], np.float32), len(directions))
    expected = closest(tree, rays, PACKETS, t_min=0.1, t_max=t_max)
    closest(tree, rays, ADAPTIVE, t_min=0.1, t_max=t_max).assert_same(expected)
    assert np.array_equal(
        occluded(tree, rays, ADAPTIVE, t_min=0.1, t_max=t_max), expected.face >= 0
    )


@each_core
def test_one_other_origin_counts(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.1))
    directions = LINES["odd sides"]
    origins = np.tile(ORIGIN, (len(directions), 1))
    for ray in (0, 1, 5_000, len(directions) - 1):
        changed = origins.copy()
        changed[ray] = [-0.5, -0.5, -2.5]
        expected = closest(tree, (changed, directions), PACKETS)
        closest(tree, (changed, directions), ADAPTIVE).assert_same(expected)


@each_core
def test_rays_that_only_seem_to_be_lines_are_sorted(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.1))
    fooled = FOOLED["partly shuffled"]
    assert core.mlrta_selftest.image_tiles(fooled) is not None

    def steps(directions: Directions) -> int:
        rays = np.tile(ORIGIN, (len(directions), 1)), directions
        return beam_steps(tree, rays, ADAPTIVE)

    # Of an eighth of the rays, squares are no squares.
    assert steps(fooled) < 2 * steps(rows(image(512, 512)))
