"""Rays with a common origin may come in any order: they are sorted where that pays."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import Options, Rays, beam_steps, build, closest, each_core, occluded

SEED = 20261128
PACKETS: Options = {"traversal": "packet"}
ADAPTIVE: Options = {"traversal": "adaptive"}
# Of 256 rays, in whatever order they come.
SMALL_BEAMS: Options = {"traversal": "beam_leaf", "minimum_tile": 16}
WIDTH, HEIGHT = 512, 37
ORIGIN = np.array([0.5, 0.5, -2.5], np.float32)


def line_by_line() -> npt.NDArray[np.float32]:
    """Directions of the pixels of an image, (N, 3)."""
    x, y = np.meshgrid(np.linspace(-0.3, 0.3, WIDTH), np.linspace(-0.02, 0.02, HEIGHT))
    return np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3).astype(np.float32)


def shuffled() -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(SEED)
    return rng.permutation(line_by_line())


def all_around() -> npt.NDArray[np.float32]:
    rng = np.random.default_rng(SEED)
    directions = rng.normal(0, 1, (20_011, 3)) * rng.uniform(0.1, 10, (20_011, 1))
    directions[::501] = 0
    directions[7::503] = np.nan
    directions[9::1009] = [0, 0, -1]
    return directions.astype(np.float32)


def one_direction() -> npt.NDArray[np.float32]:
    return np.tile(np.float32([0.01, 0.02, 1]), (5_000, 1))


ORDERS = [line_by_line, shuffled, all_around, one_direction]


def rays_of(directions: npt.NDArray[np.float32]) -> Rays:
    return np.ascontiguousarray(np.broadcast_to(ORIGIN, directions.shape)), directions


@each_core
@pytest.mark.parametrize("order", ORDERS)
def test_hits_are_those_of_packets(core: ModuleType, order: Any) -> None:
    """Packets take rays as they come."""
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.1))
    rays = rays_of(order())
    t_max = rng.choice(np.array([np.inf, 2.7, 2.2], np.float32), len(rays[0]))
    expected = closest(tree, rays, PACKETS, t_max=t_max)
    assert np.count_nonzero(expected.face >= 0) > 100, SEED
    closest(tree, rays, ADAPTIVE, t_max=t_max).assert_same(expected)
    assert np.array_equal(occluded(tree, rays, ADAPTIVE, t_max=t_max), expected.face >= 0)


@each_core
def test_no_order_costs_much_more_than_the_best(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    tree = build(core, workloads.soup(rng, 3000, 0.1))
    # Square blocks of 16 pixels, one after another.
    rows, columns = np.divmod(np.arange(WIDTH * HEIGHT), WIDTH)
    blocks = np.lexsort((columns % 16, rows % 16, columns // 16, rows // 16))
    for options in (ADAPTIVE, SMALL_BEAMS):
        best = beam_steps(tree, rays_of(line_by_line()[blocks]), options)
        assert beam_steps(tree, rays_of(line_by_line()), options) < 1.5 * best, SEED
    # Each group of 4096 rays is sorted for itself, and has less than a quarter of them.
    assert beam_steps(tree, rays_of(shuffled()), SMALL_BEAMS) < 2.5 * best, SEED
