"""Whether a line meets a triangle, against exact arithmetic, on a lattice of few points."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import oracles
from tracing import each_core

SEED = 1997


@each_core
def test_decisions_are_exact_where_volumes_vanish(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    hits = in_plane = on_edge = 0
    for _ in range(4000):
        points = rng.integers(-2, 3, (5, 3)).astype(np.float32)
        if rng.random() < 0.3:
            points[:, rng.integers(3)] = 1
            points[1, rng.integers(3)] = 0
        origin, direction, *corners = (tuple(map(float, point)) for point in points)
        if not any(direction):
            continue
        expected = oracles.meet(*map(oracles.to_point, points)) is not None
        hit, exact = core.mlrta_selftest.decide_hit(origin, direction, corners)
        assert hit == expected, (SEED, origin, direction, corners)
        hits += hit
        on_edge += hit and exact
        relative = points[2:].astype(int) - points[0].astype(int)
        volumes = (
            np.dot(points[1].astype(int), np.cross(relative[i], relative[i - 2]))
            for i in range(3)
        )
        in_plane += not any(volumes)
    assert min(hits, on_edge, in_plane) > 100
