"""Seeds of renders that are to be independent of each other."""

from __future__ import annotations

import numpy as np


def spread_seeds(start: int, count: int) -> list[int]:
    """``count`` seeds of 32 bits, without a relation to each other; the same for the same
    start.

    Mitsuba hashes seed and pixel by four rounds of TEA. No correlation of renders with
    neighbouring seeds is known (tests/compare/test_seeds.py looks for one); these need not
    rely on that, and those of different starts do not meet.
    """
    state = np.random.SeedSequence(start).generate_state(count, np.uint32)
    return [int(seed) for seed in state]
