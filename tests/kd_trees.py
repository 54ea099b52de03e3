"""Trees as the core built them, for tests that walk them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from mlrt_plugin._dispatch import core

FloatArray = npt.NDArray[np.float32]
LEAF = 3

BUILDERS: dict[str, dict[str, Any]] = {
    name: {"builder": name} for name in ("exact", "fast", "lazy")
}
"""Build options by the name of the builder that they choose."""

each_builder = pytest.mark.parametrize("builder", BUILDERS)


@dataclass(frozen=True)
class Visit:
    """A node on a walk through the tree, its cell and the number of inner nodes above."""

    node: int
    lo: FloatArray
    hi: FloatArray
    depth: int

    @property
    def area(self) -> float:
        x, y, z = np.float64(self.hi) - np.float64(self.lo)
        return float(2 * (x * y + y * z + z * x))


class BuiltTree:
    """The tree that the core builds over triangles (N, 3, 3) with some build options.

    A lazy one is finished: no ray is needed.
    """

    def __init__(self, triangles: npt.ArrayLike, **options: Any) -> None:
        self.triangles = np.ascontiguousarray(triangles, np.float32).reshape(-1, 3, 3)
        built = core.kdtree_selftest.build(self.triangles, **options)
        self.arrays = [
            built[name] for name in ("axis", "split", "child", "first_reference", "count")
        ]
        self.axis, self.split, self.child, self.first_reference, self.count = self.arrays
        self.references: npt.NDArray[np.uint32] = built["references"]
        self.lo, self.hi = np.float32(built["lo"]), np.float32(built["hi"])
        self.depth: int = built["depth"]
        self.report: dict[str, Any] = built["report"]

    def is_leaf(self, node: int) -> bool:
        return bool(self.axis[node] == LEAF)

    def referenced(self, leaf: int) -> list[int]:
        first = int(self.first_reference[leaf])
        return [int(r) for r in self.references[first : first + int(self.count[leaf])]]

    def leaves(self) -> Iterator[Visit]:
        """Yields all leaves."""
        return (visit for visit in self.walk() if self.is_leaf(visit.node))

    def expected_cost(self) -> float:
        """Cost of a ray by the surface area heuristic, with K_T = 1 and K_I = 1.5."""
        visits = list(self.walk())
        return sum(
            v.area
            / visits[0].area
            * (1.5 * int(self.count[v.node]) if self.is_leaf(v.node) else 1.0)
            for v in visits
        )

    def walk(self) -> Iterator[Visit]:
        """Yields all nodes, parents first, the lower child before the upper one."""
        stack = [Visit(0, self.lo, self.hi, 0)]
        while stack:
            visit = stack.pop()
            yield visit
            if not self.is_leaf(visit.node):
                axis, child = int(self.axis[visit.node]), int(self.child[visit.node])
                lower_hi, upper_lo = visit.hi.copy(), visit.lo.copy()
                lower_hi[axis] = upper_lo[axis] = self.split[visit.node]
                stack.append(Visit(child + 1, upper_lo, visit.hi, visit.depth + 1))
                stack.append(Visit(child, visit.lo, lower_hi, visit.depth + 1))
