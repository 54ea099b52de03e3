"""The same samples on the hits of MLRT and on those of Embree: which rays are answered in
another way?

Both sides run the same code of shading. What a ray is depends on the hits before it, so
that the rays of both sides may differ by rounding.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import drjit as dr
import mitsuba
import numpy as np
import numpy.typing as npt

from mlrt_plugin.hybrid.direct_light import DirectLight, PrimaryHits, RayHits
from mlrt_plugin.hybrid.prepared import PreparedHybrid

mi: Any = mitsuba

SHADOW, CLOSEST = "shadow", "closest"


@dataclass(frozen=True)
class Rays:
    """N rays that one call asks about, and what it is told.

    kind: CLOSEST or SHADOW. origins, directions: (N, 3) float32; ends: (N,) float32.
    answers: (N,) int64: of a closest hit the face among all of the scene, -1 for a miss,
    below that for a shape that is no mesh, the same for one shape; of a shadow ray 1 if it
    is blocked, else 0.
    """

    kind: str
    origins: npt.NDArray[np.float32]
    directions: npt.NDArray[np.float32]
    ends: npt.NDArray[np.float32]
    answers: npt.NDArray[np.int64]

    def at(self, rows: npt.NDArray[np.integer]) -> Rays:
        return Rays(
            self.kind,
            self.origins[rows],
            self.directions[rows],
            self.ends[rows],
            self.answers[rows],
        )


class Recorded:
    """Answers rays as `hits` does, and notes each call; see `RayHits`."""

    def __init__(self, hits: RayHits) -> None:
        self._hits = hits
        self.calls: list[Rays] = []

    def closest_hit(self, ray: Any, active: Any) -> tuple[Any, Any]:
        pi, face = self._hits.closest_hit(ray, active)
        # Not its index, as there may be several scenes that shapes are in.
        shape = np.array(dr.reinterpret_array(dr.uint32_array_t(face), pi.shape), np.int64)
        answers = np.array(face).astype(np.int64)
        found = np.array(pi.is_valid()) & (answers < 0)
        answers[found] = -2 - shape[found]
        self._note(CLOSEST, ray, active, answers, -1)
        return pi, face

    def any_hit(self, ray: Any, active: Any) -> Any:
        blocked = self._hits.any_hit(ray, active)
        self._note(SHADOW, ray, active, np.array(blocked).astype(np.int64), 0)
        return blocked

    def _note(
        self, kind: str, ray: Any, active: Any, answers: npt.NDArray[np.int64], none: int
    ) -> None:
        count = len(answers)
        asked = np.broadcast_to(np.array(active), count)
        self.calls.append(
            Rays(
                kind,
                vectors(ray.o, count),
                vectors(ray.d, count),
                np.array(np.broadcast_to(np.array(ray.maxt), count), np.float32),
                np.where(asked, answers, none),
            )
        )


class EmbreeHits:
    """Answers rays by Mitsuba's own scene of the same shapes, as its `direct` asks it."""

    def __init__(self, prepared: PreparedHybrid) -> None:
        module, loaded = prepared.loaded.module, prepared.loaded
        self._module = module
        properties = mi.Properties("scene")
        for number, shape in enumerate((*loaded.groups, *loaded.shapes)):
            properties[f"shape_{number:06}"] = shape
        self._scene = module.Scene(properties)
        self._faces = prepared.faces
        shapes = list(self._scene.shapes())
        is_mesh = [shape.is_mesh() and self._faces is not None for shape in shapes]
        self._is_mesh = module.Bool(np.array(is_mesh))
        assert [shape.id() for shape in shapes] == [shape.id() for shape in loaded.shapes]
        self._primary = True

    def start(self) -> None:
        """The next rays are those of the camera."""
        self._primary = True

    def closest_hit(self, ray: Any, active: Any) -> tuple[Any, Any]:
        module = self._module
        active = module.Bool(active)
        pi = self._scene.ray_intersect_preliminary(ray, self._primary, active)
        self._primary = False
        face = dr.full(module.Int32, -1, dr.width(pi))
        if self._faces is not None:
            of_mesh = dr.gather(module.Bool, self._is_mesh, pi.shape_index, pi.is_valid())
            first = dr.gather(
                module.UInt32, self._faces.first_face, pi.shape_index, pi.is_valid()
            )
            number = module.Int32(first + pi.prim_index)
            face = dr.select(pi.is_valid() & of_mesh, number, face)
        return pi, face

    def any_hit(self, ray: Any, active: Any) -> Any:
        return self._scene.ray_test(ray, False, active) & active


@dataclass
class Dispute:
    """Rays of the same samples that both sides answer in another way.

    pixel: (N,) numbers of the pixels of the film's area, of which a row follows the other.
    """

    pixel: npt.NDArray[np.int64]
    ours: Rays
    theirs: Rays


@dataclass
class Findings:
    """What a frame leaves: disputes, the rays of the pixels that are watched, and how many
    rays there were."""

    disputes: list[Dispute] = field(default_factory=list)
    watched: list[tuple[npt.NDArray[np.int64], Rays]] = field(default_factory=list)
    ray_count: int = 0

    def disputed_pixels(self) -> npt.NDArray[np.int64]:
        return np.unique(np.concatenate([d.pixel for d in self.disputes] or [EMPTY]))


EMPTY: npt.NDArray[np.int64] = np.zeros(0, np.int64)


class TwinLight:
    """A `DirectLight` on the hits of MLRT that has the same samples taken on Embree's."""

    def __init__(
        self,
        prepared: PreparedHybrid,
        emitter_samples: int,
        bsdf_samples: int,
        spp: int,
        watch: Sequence[int] | npt.NDArray[np.int64] = (),
    ) -> None:
        """spp: samples a pixel. watch: pixels of which all rays are kept."""
        self._ours = Recorded(prepared.hits())
        self._embree = EmbreeHits(prepared)
        self._theirs = Recorded(self._embree)
        counts = emitter_samples, bsdf_samples
        self._light: DirectLight = prepared.light(self._ours, *counts)
        self._twin: DirectLight = prepared.light(self._theirs, *counts)
        self._spp = spp
        self._watch = np.asarray(watch, np.int64)
        self._done = 0
        self.findings = Findings()

    def radiance(self, ray: Any, sampler: Any) -> tuple[Any, PrimaryHits]:
        """As that of `DirectLight`; notes the rays on which both sides disagree."""
        result = self._light.radiance(ray, twin_of(sampler))
        self._embree.start()
        self._twin.radiance(ray, sampler)
        ours, theirs = self._ours.calls, self._theirs.calls
        for mine, other in aligned(ours, theirs):
            self._compare(mine, other)
        self._done += dr.width(ray)
        self._ours.calls, self._theirs.calls = [], []
        return result

    def _compare(self, ours: Rays, theirs: Rays) -> None:
        pixel = (np.arange(len(ours.answers)) + self._done) // self._spp
        self.findings.ray_count += len(pixel)
        rows = np.flatnonzero(ours.answers != theirs.answers)
        if len(rows):
            self.findings.disputes.append(
                Dispute(pixel[rows], ours.at(rows), theirs.at(rows))
            )
        if len(self._watch):
            rows = np.flatnonzero(np.isin(pixel, self._watch))
            self.findings.watched.append((pixel[rows], ours.at(rows)))


def aligned(ours: list[Rays], theirs: list[Rays]) -> list[tuple[Rays, Rays]]:
    """Calls of the same purpose. Rays that go through hidden lights, which come after those
    of the camera, take as many calls as there are lights behind each other."""
    more = len(ours) - len(theirs)
    longer = ours if more > 0 else theirs
    shadows = [number for number, call in enumerate(longer) if call.kind == SHADOW]
    end = shadows[0] if shadows else len(longer)
    kept = longer[: end - abs(more)] + longer[end:]
    return list(zip(*((kept, theirs) if more > 0 else (ours, kept)), strict=True))


def twin_of(sampler: Any) -> Any:
    """A sampler that will give the same numbers."""
    if hasattr(sampler, "clone"):
        return sampler.clone()
    twin = copy.copy(sampler)
    generator = sampler._generator
    twin._generator = type(generator)(generator)
    return twin


def vectors(values: Any, count: int) -> npt.NDArray[np.float32]:
    """(count, 3) of an array of three components, of width 1 or count."""
    columns = [np.broadcast_to(np.array(values[axis]), count) for axis in range(3)]
    return np.stack(columns, axis=1).astype(np.float32)
