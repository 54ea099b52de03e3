"""Packets of which memory holds only some lanes."""

from __future__ import annotations

from types import ModuleType

import numpy as np
from tracing import each_core

SEED = 20261129
LANES = 16


@each_core
def test_lanes_that_are_set_follow_one_another(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    values = rng.normal(size=LANES).astype(np.float32)
    every_byte = [byte << shift for byte in range(256) for shift in (0, 8)]
    for bits in [*every_byte, *rng.integers(0, 1 << LANES, 1000).tolist()]:
        kept = values[(bits >> np.arange(LANES) & 1) == 1]
        np.testing.assert_array_equal(core.compressed(values, bits), kept, str(bits))


@each_core
def test_lanes_behind_the_last_value_are_zero(core: ModuleType) -> None:
    """Of a register among several all lanes may lie behind it."""
    values = np.arange(1, LANES, dtype=np.float32)
    for pad, width, least in ((core.padded, LANES, 0), (core.padded_block, 8, -LANES)):
        for count in range(least, width):
            given = max(count, 0)
            lanes = pad(values[:given].copy(), count)
            assert len(lanes) == width
            np.testing.assert_array_equal(lanes[:given], values[:given])
            np.testing.assert_array_equal(lanes[given:], 0)
