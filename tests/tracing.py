"""The native cores under test, and every way they know of tracing the same rays."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from workloads import Rays, Scene

from mlrt_plugin import _dispatch

CORES: list[ModuleType] = [_dispatch.load_core(isa) for isa in _dispatch.available_isas()]
"""The core of every instruction set that runs here."""

each_core = pytest.mark.parametrize("core", CORES, ids=[core.isa for core in CORES])

Options = dict[str, Any]

BRUTE_FORCE: Options = {"traversal": "brute_force", "entry_points": False}

TRAVERSALS: dict[str, Options] = {
    name: {"traversal": name, "entry_points": False}
    for name in ("single", "wide", "packet", "interval", "beam_leaf", "adaptive")
}
"""Traversals from the root."""


def _entry_points(**changes: Any) -> Options:
    small = {"initial_tile": 16, "minimum_tile": 4, "split_factor": 4}
    return {"traversal": "packet", "entry_points": True, **small, **changes}


ENTRY_POINTS: dict[str, Options] = {
    "default tiles": {"traversal": "packet", "entry_points": True},
    "small tiles": _entry_points(),
    "split in 16": _entry_points(initial_tile=64, split_factor=16),
    "one packet a tile": _entry_points(initial_tile=4),
    "no leaf rejection": _entry_points(leaf_rejection="none"),
    "leaf rejection by parameters": _entry_points(leaf_rejection="parameters"),
    "frustum planes": _entry_points(culling="frustum_planes"),
    "no culling": _entry_points(culling="none"),
    "paper's search order": _entry_points(search_order="paper"),
    "one entry point": _entry_points(frontier=1),
    "frontier of 16": _entry_points(frontier=16),
    "no covering triangles": _entry_points(covering_triangles=False),
    "single": _entry_points(traversal="single"),
    "wide": _entry_points(traversal="wide"),
    "interval": _entry_points(traversal="interval"),
    "adaptive": _entry_points(traversal="adaptive"),
    "beam_leaf": _entry_points(traversal="beam_leaf"),
    "beam_leaf, large tiles": _entry_points(traversal="beam_leaf", minimum_tile=16),
    "all of the paper": _entry_points(
        traversal="interval",
        leaf_rejection="parameters",
        search_order="paper",
        frontier=1,
    ),
}
"""Traversals from entry points: MLRTA in its variants."""


@dataclass(frozen=True)
class Hits:
    """What closest_hit returned; all of shape (N,). The face of a miss is -1."""

    t: npt.NDArray[np.float32]
    face: npt.NDArray[np.int32]
    u: npt.NDArray[np.float32]
    v: npt.NDArray[np.float32]

    def assert_same(self, other: Hits) -> None:
        """Asserts equality bit for bit."""
        for name in ("face", "t", "u", "v"):
            mine, theirs = getattr(self, name), getattr(other, name)
            different = np.flatnonzero(mine.view(np.uint32) != theirs.view(np.uint32))
            assert different.size == 0, (
                f"{name} of {different.size} of {mine.size} rays differs, first of ray "
                f"{different[0]}: {mine[different[0]]} and {theirs[different[0]]}"
            )


def interval(
    rays: Rays, t_min: npt.ArrayLike, t_max: npt.ArrayLike
) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
    """Returns t_min and t_max as arrays of shape (N,)."""
    count = len(rays[0])
    lowest = np.broadcast_to(np.asarray(t_min, np.float32), count)
    highest = np.broadcast_to(np.asarray(t_max, np.float32), count)
    return np.ascontiguousarray(lowest), np.ascontiguousarray(highest)


def closest(
    tree: Any,
    rays: Rays,
    options: Options,
    t_min: npt.ArrayLike = 0.0,
    t_max: npt.ArrayLike = np.inf,
) -> Hits:
    """Returns the nearest hits of rays in a tree of any core."""
    t, primitive, u, v = tree.closest_hit(*rays, *interval(rays, t_min, t_max), options)
    return Hits(t, primitive.view(np.int32), u, v)


def occluded(
    tree: Any,
    rays: Rays,
    options: Options,
    t_min: npt.ArrayLike = 0.0,
    t_max: npt.ArrayLike = np.inf,
) -> npt.NDArray[np.bool_]:
    """Returns for each ray whether anything lies in its interval."""
    return np.asarray(tree.any_hit(*rays, *interval(rays, t_min, t_max), options), bool)


def beam_steps(tree: Any, rays: Rays, options: Options) -> int:
    """Returns how many nodes the beams of rays visit."""
    counters: dict[str, int] = {}
    tree.closest_hit(*rays, *interval(rays, 0, np.inf), options, counters)
    return counters["beam_steps"]


def build(core: ModuleType, scene: Scene, **options: Any) -> Any:
    """Returns the tree of a scene."""
    return core.KdTree(*scene, **options)
