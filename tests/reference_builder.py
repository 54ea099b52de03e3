"""A kd-tree builder straight from the rules, with nothing sorted and nothing kept.

Every plane is judged by counting all references anew, O(N^2) a cell. Only the clipping of a
triangle to a cell is taken from the core, where tests compare it with exact arithmetic.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import exact_geometry as exact
import numpy as np
import numpy.typing as npt

from mlrt_plugin._dispatch import core

FloatArray = npt.NDArray[np.float32]
Plane = tuple[int, np.float32, bool]  # axis, position, whether planar triangles go below

MAX_DEPTH = 64
TIE = 2.0**-40  # costs as close as this are equal


@dataclass(frozen=True)
class Options:
    """The build options of the core, by the same names."""

    traversal_cost: float = 1.0
    intersection_cost: float = 0.25
    empty_bonus: float = 0.8
    clip: bool = True
    rule_empty_cell: bool = True
    rule_flat_cell: bool = True
    rule_area_floor: bool = True
    empty_cell_share: float = 0.1
    area_floor: float = 0.0
    max_depth: int = 0


@dataclass
class Cell:
    """A cell, and per reference the triangle's number and its bounds (2, 3) in the cell."""

    lo: FloatArray
    hi: FloatArray
    triangles: list[int] = field(default_factory=list)
    bounds: list[FloatArray] = field(default_factory=list)

    @cached_property
    def columns(self) -> list[tuple[FloatArray, FloatArray]]:
        """Returns the lower and upper bounds of all references along each axis."""
        bounds = np.array(self.bounds)
        return [(bounds[:, 0, axis].copy(), bounds[:, 1, axis].copy()) for axis in range(3)]

    @property
    def area(self) -> float:
        x, y, z = np.float64(self.hi) - np.float64(self.lo)
        return float(2 * (x * y + y * z + z * x))


@dataclass
class Node:
    """A leaf if ``plane`` is None."""

    triangles: list[int]
    plane: Plane | None = None
    children: tuple[Node, Node] | None = None
    cost: float = 0.0
    rule: str = ""


class ReferenceBuilder:
    """Builds the tree over triangles (N, 3, 3), none of them degenerate."""

    def __init__(self, triangles: FloatArray, options: Options) -> None:
        self.triangles, self.options = triangles, options
        bounds = [np.array([t.min(0), t.max(0)]) for t in triangles]
        everything = np.array(bounds)
        self.root = Cell(
            everything[:, 0].min(0),
            everything[:, 1].max(0),
            list(range(len(bounds))),
            bounds,
        )
        count = len(triangles)
        areas = np.array([Cell(lo, hi).area for lo, hi in bounds]) / self.root.area
        typical = math.exp(np.log(areas[areas > 0]).mean()) if (areas > 0).any() else 1.0
        self.floor = options.area_floor or min(6 * typical, 1e-4)
        depth = min(options.max_depth or MAX_DEPTH, MAX_DEPTH)
        splits = int(8 + 1.3 * math.log2(count))
        self.tree = self._build(self.root, depth, splits, 2, 8 + 65536 / count)

    def _leaf(self, cell: Cell, rule: str) -> Node:
        cost = self.options.intersection_cost * len(cell.triangles)
        return Node(sorted(cell.triangles), cost=cost, rule=rule)

    def _build(
        self, cell: Cell, depth: int, splits: int, bad_splits: int, duplication: float
    ) -> Node:
        options, count = self.options, len(cell.triangles)
        if count == 0 or depth == 0 or cell.area == 0:
            return self._leaf(cell, "end")
        if options.rule_area_floor and cell.area < self.floor * self.root.area:
            return self._leaf(cell, "area floor")
        plane = self._largest_empty_part(cell) if options.rule_empty_cell else None
        if plane is not None:
            return self._split(
                cell, plane, "empty cell", depth - 1, splits, bad_splits, duplication
            )
        if splits == 0:
            return self._leaf(cell, "splits")
        chosen = self._covered_plane(cell) if options.rule_flat_cell else None
        rule = "flat cell"
        if chosen is None:
            chosen, rule = self._cheapest(cell), "cost"
        if chosen is None:
            return self._leaf(cell, "no plane")
        cost, plane = chosen
        leaf = self._leaf(cell, "cost")
        bad = rule == "cost" and cost >= leaf.cost
        if bad and (bad_splits == 0 or count <= 3):
            return leaf
        below, planar, above = self._count(cell, plane)
        duplication *= count / (below + planar + above)
        if duplication < 1:
            return self._leaf(cell, "duplication")
        node = self._split(
            cell, plane, rule, depth - 1, splits - 1, bad_splits - bad, duplication
        )
        return leaf if bad and node.cost >= leaf.cost else node

    def _split(self, cell: Cell, plane: Plane, rule: str, *limits: Any) -> Node:
        axis, position, planar_below = plane
        lower, upper = Cell(cell.lo, cell.hi.copy()), Cell(cell.lo.copy(), cell.hi)
        lower.hi[axis] = upper.lo[axis] = position
        for triangle, bounds in zip(cell.triangles, cell.bounds, strict=True):
            low, high = bounds[:, axis]
            sides = [low < position, high > position]
            if not any(sides):
                sides = [planar_below, not planar_below]
            for child, wanted in zip((lower, upper), sides, strict=True):
                part = self._part(triangle, bounds, child) if all(sides) else bounds
                if wanted and part is not None:
                    child.triangles.append(triangle)
                    child.bounds.append(part)
        children = self._build(lower, *limits), self._build(upper, *limits)
        cost = self.options.traversal_cost + sum(
            child.area / cell.area * node.cost
            for child, node in zip((lower, upper), children, strict=True)
        )
        return Node([], plane, children, cost, rule)

    def _part(self, triangle: int, bounds: FloatArray, cell: Cell) -> FloatArray | None:
        lo, hi = cell.lo, cell.hi
        if self.options.clip:
            part = core.kdtree_selftest.clip_triangle(
                self.triangles[triangle].tolist(), lo.tolist(), hi.tolist()
            )
            if part is None:
                return None
            lo, hi = np.array(part, np.float32)
        result = np.array([np.maximum(bounds[0], lo), np.minimum(bounds[1], hi)])
        return result if (result[0] <= result[1]).all() else None

    def _count(self, cell: Cell, plane: Plane) -> tuple[int, int, int]:
        """Returns how many references reach below the plane, lie in it, reach above it."""
        axis, position, _ = plane
        low, high = cell.columns[axis]
        below, above = low < position, high > position
        return int(below.sum()), len(low) - int((below | above).sum()), int(above.sum())

    def _cost(self, cell: Cell, plane: Plane) -> float:
        axis, position, planar_below = plane
        below, planar, above = self._count(cell, plane)
        below, above = (below + planar, above) if planar_below else (below, above + planar)
        sides = [float(b) - float(a) for a, b in zip(cell.lo, cell.hi, strict=True)]

        def area(length: float) -> float:
            x, y, z = (*sides[:axis], length, *sides[axis + 1 :])
            return 2 * (x * y + y * z + z * x)

        lower = area(float(position) - float(cell.lo[axis]))
        upper = area(float(cell.hi[axis]) - float(position))
        cost = self.options.traversal_cost + self.options.intersection_cost * (
            lower / area(sides[axis]) * below + upper / area(sides[axis]) * above
        )
        return (
            cost * float(np.float32(self.options.empty_bonus))
            if 0 in (below, above)
            else cost
        )

    def _cheapest(self, cell: Cell) -> tuple[float, Plane] | None:
        best: tuple[float, Plane] | None = None
        for axis in range(3):
            for position in np.unique(np.array(cell.bounds)[:, :, axis]):
                if not cell.lo[axis] < position < cell.hi[axis]:
                    continue
                for planar_below in (True, False):
                    cost = self._cost(cell, (axis, position, planar_below))
                    if best is None or cost < best[0] * (1 - TIE):
                        best = cost, (axis, position, planar_below)
        return best

    def _largest_empty_part(self, cell: Cell) -> Plane | None:
        best: Plane | None = None
        largest = 0.0
        bounds = np.array(cell.bounds)
        for axis in range(3):
            length = float(cell.hi[axis]) - float(cell.lo[axis])
            if length == 0:
                continue
            first, last = bounds[:, 0, axis].min(), bounds[:, 1, axis].max()
            for share, plane in (
                ((float(first) - float(cell.lo[axis])) / length, (axis, first, False)),
                ((float(cell.hi[axis]) - float(last)) / length, (axis, last, True)),
            ):
                if (
                    share >= float(np.float32(self.options.empty_cell_share))
                    and share > largest
                ):
                    largest, best = share, plane
        return best

    def _covered_plane(self, cell: Cell) -> tuple[float, Plane] | None:
        best: tuple[float, Plane] | None = None
        for axis in range(3):
            if cell.lo[axis] == cell.hi[axis]:
                continue
            rest = [(axis + 1) % 3, (axis + 2) % 3]
            lo, hi = exact.point(cell.lo[rest]), exact.point(cell.hi[rest])
            section = (hi[0] - lo[0]) * (hi[1] - lo[1])
            for position in np.unique(np.array(cell.bounds)[:, :, axis]):
                flat = [
                    exact.clip(exact.polygon(self.triangles[t][:, rest]), lo, hi)
                    for t in cell.triangles
                    if (self.triangles[t][:, axis] == position).all()
                ]
                covered = exact.union_area(flat) if flat else Fraction(0)
                if section == 0 or covered < section * (1 - Fraction(1, 10**6)):
                    continue
                below = float(position) - float(cell.lo[axis])
                above = float(cell.hi[axis]) - float(position)
                plane = (axis, position, below <= above)
                cost = self._cost(cell, plane)
                if best is None or cost < best[0] * (1 - TIE):
                    best = cost, plane
        return best
