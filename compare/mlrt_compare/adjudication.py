"""Who is right about rays that MLRT and Embree answer in another way.

Exact arithmetic judges each side by its own ray. Where both are right, their rays differ by
rounding, or faces are equally near.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin.hybrid.hit_scene import MeshFaces
from mlrt_plugin.tree import trace_options

from .bench.exact_hits import ExactTriangles
from .twin_hits import CLOSEST, EMPTY, Dispute, Rays

UNITS = 8
"""How far a ray is moved to see whether rounding decides: units in the last place of its
largest coordinate, and of 1 for directions; chosen, a few operations' worth."""
MOVES = 32
"""How often; chosen."""
MARGIN = 1e-9
"""Of the largest coordinate, that near triangles may be off a ray besides; chosen: double
precision leaves a millionth of it."""
MOVING_SEED = 20_261_128


@dataclass(frozen=True)
class Judgement:
    """What became of rays on which both sides disagree; each is counted once."""

    rays: int = 0
    both_right: int = 0
    only_ours: int = 0
    only_theirs: int = 0
    both_wrong: int = 0
    not_judged: int = 0
    """Of shapes that are no triangle meshes, which Mitsuba intersects on both sides."""

    def as_dict(self) -> dict[str, int]:
        return dict(vars(self))

    @property
    def ours_wrong(self) -> int:
        return self.only_theirs + self.both_wrong


def adjudicate(
    disputes: Iterable[Dispute], faces: MeshFaces | None, others: bool
) -> Judgement:
    """Judges all disputes. faces: of the scene's meshes. others: whether it has shapes that
    are no meshes, which may block a shadow ray as well."""
    triangles = None
    if faces is not None:
        triangles = NearTriangles(faces.geometry.vertices, faces.geometry.faces)
    counts = dict.fromkeys(vars(Judgement()), 0)
    for dispute in disputes:
        ours, theirs = dispute.ours, dispute.theirs
        count = len(dispute.pixel)
        counts["rays"] += count
        known = np.full(count, triangles is not None)
        if others:
            of_mesh = (ours.answers >= -1) & (theirs.answers >= -1)
            known &= of_mesh & (ours.kind == CLOSEST)
        counts["not_judged"] += int(np.count_nonzero(~known))
        rows = np.flatnonzero(known)
        if triangles is None or not len(rows):
            continue
        a, b = (is_right(triangles, rays.at(rows)) for rays in (ours, theirs))
        for name, which in (
            ("both_right", a & b),
            ("only_ours", a & ~b),
            ("only_theirs", ~a & b),
            ("both_wrong", ~a & ~b),
        ):
            counts[name] += int(np.count_nonzero(which))
    return Judgement(**counts)


class NearTriangles:
    """Triangles, of which those near a ray are asked exactly."""

    def __init__(
        self, vertices: npt.NDArray[np.float32], faces: npt.NDArray[np.integer]
    ) -> None:
        self._vertices, self._faces = vertices, faces
        corners = vertices.astype(np.float64)[faces]
        self._centre = corners.mean(axis=1)
        reach = np.linalg.norm(corners - self._centre[:, None], axis=2).max(axis=1)
        # The distance of a line is rounded; by far less than that.
        self._reach = reach + MARGIN * np.abs(corners).max(initial=0)

    def nearest(self, rays: Rays, row: int) -> tuple[float, set[int]]:
        """The exact distance of a ray's nearest hit, rounded to single precision, and all
        faces that are as near; infinite if nothing is hit."""
        origin, direction = rays.origins[row], rays.directions[row]
        along = direction.astype(np.float64)
        along /= np.linalg.norm(along)
        offset = self._centre - origin
        away = offset - (offset @ along)[:, None] * along
        margin = MARGIN * np.abs(origin).max()
        near = np.flatnonzero(np.linalg.norm(away, axis=1) <= self._reach + margin)
        exact = ExactTriangles(self._vertices, self._faces[near]).nearest(
            origin[None], direction[None]
        )
        return float(exact.t[0]), {int(face) for face in near[exact.face]}


def is_right(triangles: NearTriangles, rays: Rays) -> npt.NDArray[np.bool_]:
    """Whether each answer is exact: a nearest face, a miss, or that something is in the
    way."""
    right = np.zeros(len(rays.answers), bool)
    for row, answer in enumerate(rays.answers):
        t, faces = triangles.nearest(rays, row)
        hit = np.isfinite(t) and t <= rays.ends[row]
        if rays.kind == CLOSEST:
            right[row] = int(answer) in faces if hit else answer < 0
        else:
            right[row] = hit == (answer != 0)
    return right


def decided_by_rounding(
    watched: Sequence[tuple[npt.NDArray[np.int64], Rays]], tree: Any
) -> npt.NDArray[np.int64]:
    """The pixels of which a ray hits something else once it is moved by rounding.

    tree: of the core, of all meshes.
    """
    generator = np.random.default_rng(MOVING_SEED)
    options = trace_options({})
    found = [EMPTY]
    for pixel, rays in watched:
        changed = np.zeros(len(pixel), bool)
        size = np.abs(rays.origins).max(axis=1, keepdims=True, initial=0)
        ends = np.minimum(rays.ends, np.finfo(np.float32).max)
        first: npt.NDArray[Any] | None = None
        for move in range(MOVES + 1):
            step = UNITS * 2.0**-24 * (move > 0)
            shifts = generator.uniform(-step, step, (2, *rays.origins.shape))
            moved = [
                np.ascontiguousarray(values + shift * scale, np.float32)
                for values, shift, scale in zip(
                    (rays.origins, rays.directions), shifts, (size, 1.0), strict=True
                )
            ]
            arguments = (*moved, np.zeros(len(pixel), np.float32), ends, options)
            if rays.kind == CLOSEST:
                answer = np.array(tree.closest_hit(*arguments)[1])
            else:
                answer = np.array(tree.any_hit(*arguments))
            first = answer if first is None else first
            changed |= answer != first
        found.append(pixel[changed])
    return np.unique(np.concatenate(found))
