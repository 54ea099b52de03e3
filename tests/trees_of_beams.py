"""What a beam may enter of a tree, found without a search: by asking at every node."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

LEAF = 3
Path = tuple[int, ...]


def last_common(paths: list[Path]) -> int | None:
    """Returns the deepest node that all paths from the root lead through."""
    common = None
    for nodes in zip(*paths, strict=False):
        if len(set(nodes)) > 1:
            break
        common = nodes[0]
    return common


def possible_leaves(
    nodes: list[tuple[int, float, int]],
    path: Path,
    lo: tuple[float, ...],
    hi: tuple[float, ...],
    cull: Callable[..., tuple[bool, bool]],
    possible: Callable[..., bool],
) -> Iterator[Path]:
    """Yields the path from the root to each leaf that a beam cannot exclude."""
    axis, split, child = nodes[path[-1]]
    if axis == LEAF:
        if split > 0 and possible(lo, hi):
            yield path
        return
    middle_lo, middle_hi = list(lo), list(hi)
    middle_lo[axis] = middle_hi[axis] = split
    enter_lower, enter_upper = cull(lo, hi, axis, split)
    if enter_lower:
        yield from possible_leaves(
            nodes, (*path, child), lo, tuple(middle_hi), cull, possible
        )
    if enter_upper:
        yield from possible_leaves(
            nodes, (*path, child + 1), tuple(middle_lo), hi, cull, possible
        )


def judge(core: ModuleType, beam: Any, rejection: str) -> tuple[Any, Any]:
    """Returns step 1 as (enter lower, enter upper), and step 2."""
    s = core.mlrta_selftest

    def cull(lo: Any, hi: Any, axis: int, split: float) -> tuple[bool, bool]:
        answer = s.cull_children(beam, lo, hi, axis, split)
        upper = s.upper_is_near(beam, axis, split)
        sides = answer in ("near_only", "both"), answer in ("far_only", "both")
        return sides[::-1] if upper else sides

    tests = {
        "slopes": lambda lo, hi: s.may_enter_by_slopes(beam, lo, hi),
        "parameters": lambda lo, hi: s.may_enter_by_parameters(beam, lo, hi),
        "none": lambda lo, hi: True,
    }
    return cull, tests[rejection]
