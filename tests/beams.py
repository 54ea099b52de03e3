"""Bundles of rays for tests of beams."""

from __future__ import annotations

import numpy as np
from workloads import Rays, snap


def bundle(
    rng: np.random.Generator, count: int, common_origin: bool, spread: float | None = None
) -> Rays:
    """Returns rays in about one direction, from one point or from a small box around it.

    Half of the bundles are snapped to a grid, so that zeros and equal numbers are frequent.
    """
    if spread is None:
        spread = float(rng.choice([0.001, 0.05, 0.3, 2.0]))
    origins = np.tile(rng.uniform(-2, 2, 3), (count, 1))
    directions = rng.normal(size=3) + spread * rng.uniform(-1, 1, (count, 3))
    if rng.random() < 0.3:
        directions[:, rng.integers(3)] *= 1e-4
    if not common_origin:
        origins += 0.3 * rng.uniform(-1, 1, (count, 3))
    if rng.random() < 0.5:
        origins, directions = snap(origins * 4) / 4, np.round(directions * 64) / 64
    directions[~directions.any(axis=1)] = (0, 1, 0)
    return origins.astype(np.float32), directions.astype(np.float32)
