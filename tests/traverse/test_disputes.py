"""Where MLRT and Mitsuba's Embree disagree, exact arithmetic finds for MLRT."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import oracles
import pytest
import workloads
from adjudication import Judgement, Verdict, adjudicate
from mitsuba_worker import MitsubaWorker
from tracing import Hits, build, closest

from mlrt_plugin._dispatch import core

SEED = 5
COUNT = 500
MESHES = {
    "sphere": workloads.sphere(3),
    "far sphere": workloads.moved(
        (workloads.sphere(3)[0] * np.float32(10), workloads.sphere(3)[1]), 1e6
    ),
    "fan": workloads.fan(),
}


def rays_at_features(rng: np.random.Generator, scene: workloads.Scene) -> workloads.Rays:
    """Rays from around the middle of a scene's box at vertices and midpoints of edges."""
    lo, hi = scene[0].min(axis=0), scene[0].max(axis=0)
    middle = (lo.astype(np.float64) + hi) / 2
    spread = 0.15 * float((hi - lo).max()) * rng.uniform(-1, 1, (2 * COUNT, 3))
    origins = (middle + spread + (0, 0, 0.2 * float((hi - lo).max()))).astype(np.float32)
    corners = scene[0][rng.choice(scene[1], COUNT)].astype(np.float64)
    targets = np.concatenate([corners[:, 0], (corners[:, 0] + corners[:, 1]) / 2])
    return origins, targets.astype(np.float32) - origins


def judged(
    folder: Path, mitsuba: MitsubaWorker, scene: workloads.Scene, rays: workloads.Rays
) -> Judgement:
    arrays = folder / "rays.npz"
    named = zip(
        ("vertices", "faces", "origins", "directions"), (*scene, *rays), strict=True
    )
    np.savez(arrays, **dict(named))
    sides = {"MLRT": closest(build(core, scene), rays, {})}
    for name, robust in (("Mitsuba", False), ("Mitsuba, robust", True)):
        t, face = mitsuba("nearest_hits", arrays=str(arrays), robust=robust)
        zero = np.zeros(len(t), np.float32)
        sides[name] = Hits(t.astype(np.float32), face.astype(np.int32), zero, zero)
    return adjudicate(oracles.Soup(*scene), rays, sides)


@pytest.mark.parametrize("name", MESHES)
def test_mlrt_is_right_in_every_dispute(
    tmp_path: Path, mitsuba_llvm: MitsubaWorker, name: str
) -> None:
    scene = MESHES[name]
    rays = rays_at_features(np.random.default_rng(SEED), scene)
    judgement = judged(tmp_path, mitsuba_llvm, scene, rays)
    counts = {
        side: {verdict.value: n for verdict, n in verdicts.items()}
        for side, verdicts in judgement.counts.items()
    }
    print(
        f"{name}, seed {SEED}, {2 * COUNT} rays, {len(judgement.disputes)} disputes:",
        counts,
    )
    assert judgement.wrong("MLRT") == 0, counts
    # There is something to judge, and robust intersections lose fewer rays.
    assert judgement.wrong("Mitsuba") > 0
    leaks = [
        judgement.counts[side][Verdict.LEAK] for side in ("Mitsuba, robust", "Mitsuba")
    ]
    assert leaks == sorted(leaks)
    # All is about rays that pass edges by, as rounding has them: 2^-18 of a coordinate.
    size = float(np.abs(scene[0]).max())
    assert max(d.edge_distance for d in judgement.disputes) < 2.0**-18 * size
