"""Traces a case in every way and compares with exact arithmetic."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from types import ModuleType

import numpy as np
import numpy.typing as npt
import oracles
from kd_trees import BUILDERS
from tracing import (
    BRUTE_FORCE,
    ENTRY_POINTS,
    TRAVERSALS,
    Hits,
    Options,
    build,
    closest,
    interval,
    occluded,
)

from .case import SEED, HardCase, Listed, RaySet

WAYS: dict[str, Options] = {
    "brute force": BRUTE_FORCE,
    **TRAVERSALS,
    **{
        f"entry points, {name}": ENTRY_POINTS[name]
        for name in (
            "default tiles",
            "small tiles",
            "split in 16",
            "frustum planes",
            "single",
            "wide",
            "interval",
            "adaptive",
            "beam_leaf",
            "no covering triangles",
            "all of the paper",
        )
    },
}
"""X0 to X4, from the root and from entry points."""

WIDTHS = (1, 8, 16)
GROUPS = 4
"""Calls of each width, spread over the rays of a set."""


@dataclass(frozen=True)
class Expected:
    """The exact hit of each ray, (N,): face -1 and t inf for a miss."""

    face: npt.NDArray[np.int32]
    t: npt.NDArray[np.float32]


def expected_hits(case: HardCase, rays: RaySet) -> Expected:
    """The exact hits; they must be those that were told by hand."""
    # What lies behind the origin does not count, whatever t_min is.
    t_min = np.maximum(np.asarray(rays.t_min, np.float32), np.float32(0))
    hits = oracles.Soup(*case.scene).hits(*rays.rays, t_min, rays.t_max)
    face = np.array([-1 if hit is None else hit.face for hit in hits])
    t = np.array([math.inf if hit is None else hit.t for hit in hits], np.float32)
    if rays.faces is not None:
        np.testing.assert_array_equal(face, np.broadcast_to(rays.faces, face.shape))
    if rays.t is not None:
        by_hand = np.broadcast_to(np.asarray(rays.t, np.float32), t.shape)
        np.testing.assert_array_equal(t, by_hand)
    if rays.every_ray_hits:
        assert (face >= 0).all(), "the case itself is wrong: exact arithmetic finds misses"
    return Expected(face.astype(np.int32), t)


@cache
def solved(listed: Listed) -> tuple[HardCase, dict[str, Expected]]:
    """A case and its exact hits, which all builders and cores share."""
    case = listed.make()
    kinds = {rays.shares_origin for rays in case.sets.values() if len(rays.rays[0]) > 1}
    assert kinds == {True, False}, "rays must share an origin in one set, not in another"
    return case, {name: expected_hits(case, rays) for name, rays in case.sets.items()}


def check(core: ModuleType, listed: Listed, builder: str) -> None:
    """Asserts that all ways return the exact hits, bit for bit."""
    case, expected = solved(listed)
    tree = build(core, case.scene, **BUILDERS[builder], **case.options)
    case.tree(dict(tree.report))
    for way, options in WAYS.items():
        if builder == "lazy":
            # It grows as it is traced.
            tree = build(core, case.scene, **BUILDERS[builder], **case.options)
        for name, rays in case.sets.items():
            checker = _Checker(tree, rays, options, expected[name], f"{way}, {name}")
            checker.check(slice(None))
            count = len(rays.rays[0])
            for width in WIDTHS:
                last = max(count - width, 0)
                for first in sorted(
                    {round(last * i / (GROUPS - 1)) for i in range(GROUPS)}
                ):
                    checker.check(slice(first, first + width))


class _Checker:
    def __init__(
        self,
        tree: object,
        rays: RaySet,
        options: Options,
        expected: Expected,
        name: str,
    ) -> None:
        self.tree = tree
        self.rays = rays
        self.options = options
        self.name = name
        self.ends = interval(rays.rays, rays.t_min, rays.t_max)
        self.expected = expected

    def check(self, part: slice) -> None:
        rays = self.rays.rays[0][part], self.rays.rays[1][part]
        ends = self.ends[0][part], self.ends[1][part]
        found = closest(self.tree, rays, self.options, *ends)
        self.assert_right(found, part)
        hit = occluded(self.tree, rays, self.options, *ends)
        np.testing.assert_array_equal(hit, self.expected.face[part] >= 0, err_msg=self.name)

    def assert_right(self, found: Hits, part: slice) -> None:
        face, t = self.expected.face[part], self.expected.t[part]
        wrong = np.flatnonzero((found.face != face) | (found.t != t))
        assert wrong.size == 0, "\n".join(
            [f"{self.name}: {wrong.size} of {len(face)} rays are wrong (seed {SEED}):"]
            + [
                f"{self.rays.rays[0][part][i]} + t {self.rays.rays[1][part][i]}: face "
                f"{found.face[i]} at {found.t[i]}, not {face[i]} at {t[i]}"
                for i in wrong[:5]
            ]
        )
        for weight in (found.u, found.v):
            assert ((weight >= 0) & (weight <= 1)).all(), self.name
