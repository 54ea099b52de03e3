"""How many times as fast as the best mode of Embree rays are meant to be traced."""

from __future__ import annotations

from typing import Any

from .contenders import EMBREE, MLRT
from .rays_contenders import INEXACT, WATERTIGHT
from .speedup import Speedup, best_frame, median_frame, speedup

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


def ray_speedup(scene: str, block: dict[str, Any]) -> Speedup:
    """Of MLRT beside whichever mode of Embree is the fastest."""
    contenders = block["contenders"]
    own = next(c for c in contenders if c["engine"] == MLRT)
    goals = GOALS.get((block["spp"], block["shadows"]), {})
    return speedup(own, peers_of(block), *goals.get(scene, (None, None)))


def cost_of_exactness(block: dict[str, Any]) -> dict[str, float] | None:
    """Seconds of MLRT over those of MLRT that trusts single precision, if that was
    measured: the best and the median on the clock, and the best in CPU time."""
    return cost_beside_inexact(block, MLRT)


def cost_of_watertightness(block: dict[str, Any]) -> dict[str, float] | None:
    """The same of MLRT that trusts single precision in distances alone."""
    return cost_beside_inexact(block, f"{MLRT} {WATERTIGHT}")


def cost_beside_inexact(block: dict[str, Any], name: str) -> dict[str, float] | None:
    by_name = {contender["name"]: contender for contender in block["contenders"]}
    own, inexact = by_name.get(name), by_name.get(f"{MLRT} {INEXACT}")
    if own is None or inexact is None:
        return None
    return {
        name: figure(own, clock) / figure(inexact, clock)
        for name, figure, clock in (
            ("best", best_frame, "wall"),
            ("median", median_frame, "wall"),
            ("cpu", best_frame, "cpu"),
        )
    }


def peers_of(block: dict[str, Any]) -> list[dict[str, Any]]:
    return [c for c in block["contenders"] if c["engine"] == EMBREE]


def fastest_peer(block: dict[str, Any]) -> dict[str, Any]:
    """The contender of Embree with the best frame on the clock."""
    return min(peers_of(block), key=best_frame)
