"""mlrt-bench hits: adversarial rays against exact arithmetic, wrong hits counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .adversarial import RAYS, Rays, SmallScene, shared_origin
from .exact_hits import ExactHits, ExactTriangles
from .hit_contenders import HitArrays, HitContender

BATCH = 2**16
SHARING = 1024
"""Rays in a row that start at the same point, in half of each batch."""
FAR_OFF = 2.0**-20
"""Of the distance: a wrong face that is further off is not just a neighbour."""


@dataclass
class Errors:
    """Of one contender: numbers of rays."""

    misses: int = 0
    """Nothing found, though something is hit."""
    false_hits: int = 0
    """Something found, though nothing is hit."""
    wrong_faces: int = 0
    """Another face than those that are nearest."""
    far_off: int = 0
    """Of these and of false hits: by more than FAR_OFF of the distance, or all of it."""
    right: int = 0
    """Rays that hit what they should; of these:"""
    greatest_ulps: int = 0
    """The greatest error of t, in units in the last place."""
    inexact: int = 0
    """How often t is not the float nearest to the exact one."""

    @property
    def wrong(self) -> int:
        return self.misses + self.false_hits + self.wrong_faces

    def as_json(self) -> dict[str, int]:
        return {**vars(self), "wrong": self.wrong}

    def add(
        self, exact: ExactHits, found: HitArrays, chosen: npt.NDArray[np.bool_]
    ) -> None:
        """Counts the chosen rays."""
        t, face = found
        hit, claimed = exact.is_hit(), face >= 0
        right = exact.includes(face)
        wrong_face = chosen & hit & claimed & ~right
        false_hit = chosen & ~hit & claimed
        self.misses += int(np.count_nonzero(chosen & hit & ~claimed))
        self.false_hits += int(np.count_nonzero(false_hit))
        self.wrong_faces += int(np.count_nonzero(wrong_face))
        with np.errstate(invalid="ignore"):
            off = np.abs(t.astype(np.float64) - exact.t) > FAR_OFF * exact.t
        self.far_off += int(np.count_nonzero(false_hit | (wrong_face & off)))
        correct = chosen & right
        self.right += int(np.count_nonzero(correct))
        # Positive floats are in the order of their bits.
        bits = t[correct].view(np.int32).astype(np.int64) - exact.t[correct].view(np.int32)
        self.inexact += int(np.count_nonzero(bits))
        self.greatest_ulps = max(self.greatest_ulps, int(np.abs(bits).max(initial=0)))


@dataclass(frozen=True)
class Counted:
    errors: dict[str, Errors]
    rays: int
    at_origin: int
    """Rays that start on a face, which may or may not count as hit: left out."""
    exact_pairs: int


def count(
    scene: SmallScene,
    contenders: list[HitContender],
    make: Callable[[np.random.Generator, SmallScene, int], Rays],
    number: int,
    seed: int,
) -> Counted:
    """Traces the same rays with all contenders."""
    rng = np.random.default_rng(seed)
    triangles = ExactTriangles(scene.vertices, scene.faces)
    errors = {contender.name: Errors() for contender in contenders}
    at_origin = exact_pairs = 0
    for first in range(0, number, BATCH):
        rays = make(rng, scene, min(BATCH, number - first))
        # Halves of a batch, one of them with origins in common.
        half = len(rays[0]) // 2
        shared = shared_origin((rays[0][half:], rays[1][half:]), SHARING)
        origins, directions = (
            np.concatenate([own[:half], common])
            for own, common in zip(rays, shared, strict=True)
        )
        exact = triangles.nearest(origins, directions)
        exact_pairs += exact.exact_pairs
        found = [contender.closest_hit(origins, directions) for contender in contenders]
        starts = np.zeros(len(origins), bool)
        for t, face in found:
            starts |= (face >= 0) & (t == 0)
        at_origin += int(np.count_nonzero(starts))
        for contender, hits in zip(contenders, found, strict=True):
            errors[contender.name].add(exact, hits, ~starts)
    return Counted(errors, number, at_origin, exact_pairs)


def study(
    scene: SmallScene, contenders: list[HitContender], number: int, seed: int
) -> list[dict[str, Any]]:
    """A row for each kind of rays, as JSON has it."""
    rows = []
    for kind, make in enumerate(RAYS):
        counted = count(scene, contenders, make, number, seed + kind)
        rows.append(
            {
                "rays_of": make.__name__,
                "rays": counted.rays,
                "at_origin": counted.at_origin,
                "exact_pairs": counted.exact_pairs,
                "errors": {name: e.as_json() for name, e in counted.errors.items()},
            }
        )
    return rows
