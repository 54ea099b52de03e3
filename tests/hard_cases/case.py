"""What a hard case is, and the list of all of them.

A case is a function that makes a HardCase; the decorator `case` gives it its number and
puts it on the list. The docstring of the function says in a sentence why it is hard.

What is expected comes from exact arithmetic (`oracles`), for each ray. Where the answer can
be told by hand it is written down as well, and the oracle must agree.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from workloads import FloatArray, Rays, Scene

SEED = 20261128
MISS = -1


@dataclass(frozen=True)
class RaySet:
    """Rays that share an origin, or rays that do not."""

    rays: Rays
    faces: npt.ArrayLike | None = None
    """By hand, (N,) or one for all: what each ray hits, MISS for nothing."""
    t: npt.ArrayLike | None = None
    """By hand, (N,) or one for all: where; inf for a miss."""
    every_ray_hits: bool = False
    """By hand: no ray may find nothing, whatever it hits."""
    t_min: npt.ArrayLike = 0.0
    t_max: npt.ArrayLike = math.inf

    @property
    def shares_origin(self) -> bool:
        origins = self.rays[0]
        return bool((origins == origins[:1]).all())


@dataclass(frozen=True)
class HardCase:
    """A small scene and what is traced through it.

    At least one set of rays shares an origin and one does not: they take different ways
    through the tracer.
    """

    scene: Scene
    sets: Mapping[str, RaySet]
    options: dict[str, Any] = field(default_factory=dict)
    """Of the builder."""
    tree: Callable[[dict[str, Any]], None] = lambda report: None
    """Asserts what is known of the tree from the builder's report."""


@dataclass(frozen=True)
class Listed:
    number: int
    make: Callable[[], HardCase]

    def __str__(self) -> str:
        return f"{self.number:02} {self.make.__name__}"


CASES: list[Listed] = []


def case(number: int) -> Callable[[Callable[[], HardCase]], Callable[[], HardCase]]:
    """Lists a function that makes a case under its number."""

    def enlist(make: Callable[[], HardCase]) -> Callable[[], HardCase]:
        assert make.__doc__, f"case {number} does not say why it is hard"
        CASES.append(Listed(number, make))
        return make

    return enlist


Test = TypeVar("Test", bound=Callable[..., None])


def covers(number: int) -> Callable[[Test], Test]:
    """Marks a test of a case that takes more than tracing rays; its docstring says why the
    case is hard."""

    def marked(test: Test) -> Test:
        assert test.__doc__, f"case {number} does not say why it is hard"
        test.hard_case = number  # type: ignore[attr-defined]  # for `outcomes`
        return test

    return marked


def generator() -> np.random.Generator:
    return np.random.default_rng(SEED)


def rows(*vectors: tuple[float, ...]) -> FloatArray:
    """Vectors as an array of single precision."""
    return np.array(vectors, np.float32).reshape(-1, 3)


def towards(origins: npt.ArrayLike, targets: npt.ArrayLike) -> Rays:
    """Rays from each origin, or one for all, to each target, of parameter 1 there."""
    start, end = np.broadcast_arrays(
        np.asarray(origins, np.float32), np.asarray(targets, np.float32)
    )
    return np.ascontiguousarray(start), (end - start).astype(np.float32)


def along(origins: npt.ArrayLike, directions: npt.ArrayLike) -> Rays:
    """Rays of given directions, from each origin or one for all."""
    start, direction = np.broadcast_arrays(
        np.asarray(origins, np.float32), np.asarray(directions, np.float32)
    )
    return np.ascontiguousarray(start), np.ascontiguousarray(direction)


def joined(*scenes: Scene) -> Scene:
    """Several scenes in one, faces in their order."""
    vertices, faces, first = [], [], 0
    for points, corners in scenes:
        vertices.append(points)
        faces.append(corners + np.uint32(first))
        first += len(points)
    return np.concatenate(vertices), np.concatenate(faces).astype(np.uint32)


def quad(*corners: tuple[float, float, float]) -> Scene:
    """Two triangles (0, 1, 2) and (0, 2, 3)."""
    return rows(*corners), np.array([(0, 1, 2), (0, 2, 3)], np.uint32)


def triangles(*corners: tuple[tuple[float, float, float], ...]) -> Scene:
    """Triangles that share nothing."""
    vertices = np.array(corners, np.float32).reshape(-1, 3)
    return vertices, np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)


def grid(count: int, axis: int = 2, low: float = -1, high: float = 1) -> Scene:
    """A square of 2 count^2 triangles with shared vertices, in the plane {x[axis] = 0}."""
    steps = np.linspace(low, high, count + 1)
    u, v = np.meshgrid(steps, steps, indexing="ij")
    vertices = np.insert(np.stack([u.ravel(), v.ravel()], 1), axis, 0, 1).astype(np.float32)
    i, j = (index.ravel() for index in np.indices((count, count)))
    at = i * (count + 1) + j
    one = np.stack([at, at + count + 1, at + count + 2], axis=1)
    other = np.stack([at, at + count + 2, at + 1], axis=1)
    return vertices, np.stack([one, other], axis=1).reshape(-1, 3).astype(np.uint32)
