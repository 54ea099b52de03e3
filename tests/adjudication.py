"""Who is right where tracers disagree: exact arithmetic decides, and each side is counted.

A side hits the right face if that is one of those at the exact nearest distance, rounded
to float32: which of equally near faces counts is a matter of each tracer's contract.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Protocol

import numpy as np
import numpy.typing as npt
from edge_distance import edge_distance
from oracles import Hit, Soup
from workloads import Rays


class Side(Protocol):
    """What a tracer claims: (N,) distances and faces, -1 for a miss."""

    @property
    def t(self) -> npt.NDArray[np.float32]: ...
    @property
    def face(self) -> npt.NDArray[np.int32]: ...


class Verdict(Enum):
    RIGHT = "right"
    LEAK = "a miss, though something is hit"
    FALSE_HIT = "a hit, though nothing is"
    WRONG_FACE = "another face than those that are nearest"


def judge(expected: Hit | None, face: int) -> Verdict:
    """Compares one claim with the exact hit."""
    if expected is None:
        return Verdict.RIGHT if face < 0 else Verdict.FALSE_HIT
    if face < 0:
        return Verdict.LEAK
    return Verdict.RIGHT if face in expected.faces else Verdict.WRONG_FACE


@dataclass(frozen=True)
class Dispute:
    """A ray for which sides claim different faces."""

    ray: int
    expected: Hit | None
    verdicts: dict[str, Verdict]
    edge_distance: float
    """Of the ray's line to the nearest edge of the claimed and the right faces; inf if
    there is no such face."""


@dataclass
class Judgement:
    """All disputes, and how often each side deserves each verdict in them."""

    disputes: list[Dispute] = field(default_factory=list)
    counts: dict[str, Counter[Verdict]] = field(default_factory=dict)

    def wrong(self, side: str) -> int:
        """How many disputes a side loses."""
        return sum(
            n for verdict, n in self.counts[side].items() if verdict != Verdict.RIGHT
        )


def adjudicate(
    soup: Soup,
    rays: Rays,
    sides: Mapping[str, Side],
    t_min: npt.ArrayLike = 0.0,
    t_max: npt.ArrayLike = math.inf,
) -> Judgement:
    """Judges the claims about all rays on whose face the sides do not agree."""
    faces = np.stack([np.asarray(side.face, np.int64) for side in sides.values()])
    disputed = np.flatnonzero((faces != faces[0]).any(axis=0))
    count = len(rays[0])
    ends = (np.broadcast_to(np.asarray(t, np.float32), count) for t in (t_min, t_max))
    exact = soup.hits(
        rays[0][disputed], rays[1][disputed], *(end[disputed] for end in ends)
    )
    judgement = Judgement(counts={name: Counter() for name in sides})
    for ray, hit in zip(disputed, exact, strict=True):
        verdicts = {
            name: judge(hit, int(claimed))
            for name, claimed in zip(sides, faces[:, ray], strict=True)
        }
        near = {int(face) for face in faces[:, ray] if face >= 0}
        near |= set(hit.faces if hit else ())
        distance = edge_distance(soup, rays[0][ray], rays[1][ray], near)
        judgement.disputes.append(Dispute(int(ray), hit, verdicts, distance))
        for name, verdict in verdicts.items():
            judgement.counts[name][verdict] += 1
    return judgement
