"""What rays that go alone through the wide tree leave undone."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import workloads
from tracing import BRUTE_FORCE, TRAVERSALS, build, closest, each_core, interval, occluded

SEED = 20261130


@each_core
def test_what_lies_before_the_interval_is_not_decided(core: ModuleType) -> None:
    """Rays through vertices, of which single precision does not know what they hit, begin
    behind these."""
    rng = np.random.default_rng(SEED)
    scene = vertices, _ = workloads.soup(rng, 500, 0.4)
    origins = rng.uniform(-1, 2, (2000, 3)).astype(np.float32)
    rays = origins, vertices[rng.integers(len(vertices), size=2000)] - origins
    tree = build(core, scene)
    tree.widen()
    for query in (tree.closest_hit, tree.any_hit):
        decided = []
        for t_min in (0, 1.01):
            counters: dict[str, int] = {}
            query(*rays, *interval(rays, t_min, np.inf), TRAVERSALS["wide"], counters)
            decided.append(counters["double_tests"])
        assert 20 * decided[1] < decided[0], f"seed {SEED}"
    expected = closest(tree, rays, BRUTE_FORCE, 1.01)
    closest(tree, rays, TRAVERSALS["wide"], 1.01).assert_same(expected)
    hit = occluded(tree, rays, TRAVERSALS["wide"], 1.01)
    np.testing.assert_array_equal(hit, expected.face >= 0)
