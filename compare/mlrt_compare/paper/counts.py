"""Steps and tests for each packet of 16 rays, the unit of the paper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

PACKET_RAYS = 16
KINDS = {
    "primary": ("primary_",),
    "shadow": ("shadow_",),
    "primary_and_shadow": ("primary_", "shadow_"),
}
"""Rays that are counted, by the prefixes of the tracer's counters."""


@dataclass(frozen=True)
class Counts:
    """For each 16 rays of the camera, k / (W H / 16) of a frame (Reshetov et al. 2005,
    section 4), whether or not all of them have a shadow ray.

    steps: nodes visited, leaves and those of entry point searches included (ATS).
    entry_steps: of these, those of the searches.
    tests: triangles that a packet, or a ray where single ones are traced, was tested
    against.
    frontier_tests: packets clipped to the cells of further entry points, which are no
    steps of the paper.
    """

    steps: float
    entry_steps: float
    tests: float
    frontier_tests: float

    def as_dict(self) -> dict[str, float]:
        return asdict(self)


def counts_of(counters: Mapping[str, int], kind: str, rays: int) -> Counts:
    """Of what `PreparedScene.render` counted.

    kind: a key of KINDS. rays: of the camera.
    """
    prefixes = KINDS[kind]

    def total(name: str) -> float:
        return PACKET_RAYS * sum(counters[prefix + name] for prefix in prefixes) / rays

    entry_steps = total("entry_steps")
    return Counts(
        steps=entry_steps + total("traversal_steps"),
        entry_steps=entry_steps,
        tests=total("triangle_tests"),
        frontier_tests=total("frontier_tests"),
    )
