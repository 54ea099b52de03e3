"""When beams are given up: the budget's rules, told once more."""

from __future__ import annotations

from types import ModuleType

import numpy as np
from tracing import each_core

SEED = 20261129


@each_core
def test_budgets_end_at_most_triangles_or_where_little_is_found(core: ModuleType) -> None:
    rng = np.random.default_rng(SEED)
    by_count = by_yield = kept = 0
    for _ in range(200):
        most = int(rng.integers(200, 3000))
        first_look = int(rng.integers(1, 400))
        least_yield = float(np.float32(rng.uniform(0, 0.6)))
        triangles = [int(n) for n in rng.integers(0, 200, 12)]
        found = [int(n) for n in np.sort(rng.integers(0, 800, 12))]
        told = core.beam_leaf_selftest.spent_after(
            most, first_look, least_yield, list(zip(triangles, found, strict=True))
        )
        looks = [first_look * 2**k for k in range(16)]
        little = False
        for step, is_spent in enumerate(told):
            before, now = sum(triangles[:step]), sum(triangles[: step + 1])
            if any(before < look <= now for look in looks):
                little |= found[step] < least_yield * now
            assert is_spent == (now >= most or little), (SEED, step)
            by_count += now >= most
            by_yield += now < most and little
            kept += not is_spent
    assert min(by_count, by_yield, kept) > 100, (SEED, by_count, by_yield, kept)


@each_core
def test_a_budget_that_asks_for_nothing_looks_at_nothing(core: ModuleType) -> None:
    steps = [(100, 0)] * 5
    spent = core.beam_leaf_selftest.spent_after(450, 1, 0.0, steps)
    assert spent == [False] * 4 + [True]
