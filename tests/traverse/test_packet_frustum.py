"""Which boxes the rays of a packet may enter, against fractions."""

from __future__ import annotations

from fractions import Fraction
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
from tracing import each_core

SEED = 20261201

Floats = npt.NDArray[np.float32]


def enters(origin: Floats, direction: Floats, box: npt.NDArray[np.float32]) -> bool:
    """Whether the ray has a point in the box ahead of its origin."""
    near, far = Fraction(0), None
    for k in range(3):
        o, d = Fraction(float(origin[k])), Fraction(float(direction[k]))
        lo, hi = Fraction(float(box[0, k])) - o, Fraction(float(box[1, k])) - o
        if d == 0:
            if not lo <= 0 <= hi:
                return False
            continue
        first, last = sorted((lo / d, hi / d))
        near, far = max(near, first), last if far is None else min(far, last)
    return far is not None and near <= far and far > 0


def packet(rng: np.random.Generator, spread: float) -> Floats:
    """Directions of up to sixteen rays that are close to each other."""
    middle = rng.normal(size=3)
    if rng.random() < 0.3:
        middle[rng.integers(3)] = 0
    directions = (middle + spread * rng.normal(size=(rng.integers(1, 17), 3))).astype(
        np.float32
    )
    for zero in np.float32([0.0, -0.0, 2.0**-99]):
        directions[rng.random(directions.shape) < 0.05] = zero
    directions[~directions.any(axis=1)] = 1
    return directions


def boxes_at(rng: np.random.Generator, origin: Floats, directions: Floats) -> Floats:
    """Boxes with a corner, an edge or a face on a ray, to within rounding, flat ones, and
    ones that the origin is in."""
    boxes = np.empty((8, 2, 3), np.float32)
    for i in range(8):
        ray = rng.choice(directions)
        point = (origin + np.float32(rng.choice([0, 1e-3, 1, 30])) * ray).astype(np.float32)
        size = rng.choice([0, 1e-6, 0.1, 10], (2, 3)) * rng.random((2, 3))
        boxes[i] = point - size[0], point + size[1]
    return boxes


@each_core
@pytest.mark.parametrize("power", [-100, -60, 0, 60])
@pytest.mark.parametrize("spread", [0, 1e-3, 0.5])
def test_no_box_is_missed(core: ModuleType, power: int, spread: float) -> None:
    rng = np.random.default_rng(SEED)
    entered = left_out = 0
    for _ in range(60):
        origin = rng.normal(size=3) * rng.choice([0, 1, 100])
        directions = packet(rng, spread)
        scale = np.float32(2.0**power)
        start = origin.astype(np.float32)
        boxes = boxes_at(rng, start, directions) * scale
        start = start * scale
        given = np.repeat(directions[:, None], 3, axis=1)
        corners = np.concatenate([boxes, boxes[:, :1]], axis=1)
        along, by_all, rays, alone = core.wide_selftest.entered_boxes(
            tuple(map(float, start)), given, corners
        )
        assert along > 0
        for lane, direction in enumerate(directions):
            if not along >> lane & 1:
                continue
            for i, box in enumerate(boxes):
                told = by_all >> i & rays[i] >> lane & alone[lane] >> i & 1
                if enters(start, direction, box):
                    entered += 1
                    assert told, (SEED, start, direction, box)
                else:
                    left_out += not told
    assert min(entered, left_out) > 200, (SEED, entered, left_out)
