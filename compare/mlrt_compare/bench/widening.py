"""Brings prepared scenes to where their frames stay: to the wide form of their trees."""

from __future__ import annotations

from typing import Any

from .measure import Timing, process_timed


def widen(prepared: Any) -> Timing | None:
    """Makes the form of the tree for rays that go alone, which some frame to come would
    make, and tells what it takes; None where it is never made: of a lazy tree, or for want
    of memory.

    prepared: natively shaded.
    """
    if prepared.report["builder"] == "lazy":
        return None
    try:
        return process_timed(prepared.tree.widen)
    except MemoryError:
        return None
