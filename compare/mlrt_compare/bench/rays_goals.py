"""How many times as fast as the best mode of Embree rays are meant to be traced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from .contenders import EMBREE, MLRT
from .goals import counted_runs, judged
from .measure import best, median

Work = tuple[int, bool]
"""Samples a pixel, and whether there are shadow rays."""
GOALS: dict[Work, dict[str, tuple[float, float | None]]] = {
    (1, False): {
        "office": (4.5, 6.0),
        "conference": (2.0, 3.0),
        "building": (3.5, 5.0),
        "dragon-7.2M": (1.3, 2.5),
    },
    (1, True): {
        "office": (3.5, 5.0),
        "conference": (1.3, 2.0),
        "building": (2.0, 3.0),
        "dragon-7.2M": (1.0, 1.5),
    },
    (16, False): {
        "office": (4.0, None),
        "conference": (2.5, None),
        "building": (2.5, None),
        "dragon-7.2M": (1.5, None),
    },
}
"""Goal and stretch goal by scene."""
Pick = Callable[[list[float]], float]


@dataclass(frozen=True)
class Speedup:
    """Seconds of a peer divided by MLRT's, and what they are meant to be at least."""

    best: float
    """Of the best runs on the clock."""
    median: float
    cpu: float
    """Of the best runs, time of all threads."""
    goal: float | None
    stretch: float | None

    @property
    def verdict(self) -> str:
        return self._reached(self.goal)

    @property
    def stretch_verdict(self) -> str:
        return self._reached(self.stretch)

    def _reached(self, limit: float | None) -> str:
        if limit is None:
            return "not a goal"
        return judged(self.best >= limit, self.median >= limit)

    def as_dict(self) -> dict[str, Any]:
        return {
            **asdict(self),
            "verdict": self.verdict,
            "stretch_verdict": self.stretch_verdict,
        }


def frame_seconds(contender: dict[str, Any], clock: str) -> list[float]:
    """Seconds of a frame in each run that counts; ``clock`` is wall or cpu."""
    return [run["frame"][clock] for run in counted_runs(contender)]


def speedup(scene: str, block: dict[str, Any]) -> Speedup:
    """Of MLRT beside whichever mode of Embree is the fastest, by each figure."""
    contenders = block["contenders"]
    own = next(c for c in contenders if c["engine"] == MLRT)
    peers = [c for c in contenders if c["engine"] == EMBREE]

    def ratio(pick: Pick, clock: str) -> float:
        fastest = min(pick(frame_seconds(peer, clock)) for peer in peers)
        return fastest / pick(frame_seconds(own, clock))

    goal, stretch = GOALS.get((block["spp"], block["shadows"]), {}).get(scene, (None, None))
    return Speedup(
        best=ratio(best, "wall"),
        median=ratio(median, "wall"),
        cpu=ratio(best, "cpu"),
        goal=goal,
        stretch=stretch,
    )


def fastest_peer(block: dict[str, Any]) -> dict[str, Any]:
    """The contender of Embree with the best frame on the clock."""
    peers = [c for c in block["contenders"] if c["engine"] == EMBREE]
    return min(peers, key=lambda peer: best(frame_seconds(peer, "wall")))
