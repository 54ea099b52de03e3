"""Closed meshes have no holes: rays from inside meet them, whatever they are aimed at."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest
import workloads
from tracing import (
    BRUTE_FORCE,
    ENTRY_POINTS,
    TRAVERSALS,
    Options,
    build,
    closest,
    each_core,
)

SEED = 777
COUNT = 4000
TRACED: dict[str, Options] = {
    "brute force": BRUTE_FORCE,
    **TRAVERSALS,
    "entry points": ENTRY_POINTS["small tiles"],
}
MESHES = {
    "box": workloads.box(),
    "sphere": workloads.sphere(3),
    "far sphere": workloads.moved(workloads.sphere(3), 1e6),
    "small sphere": (workloads.sphere(3)[0] * np.float32(1e-3), workloads.sphere(3)[1]),
}


def rays_from_inside(rng: np.random.Generator, mesh: workloads.Scene) -> workloads.Rays:
    """Rays at vertices, midpoints of edges and other points of edges, a third of each."""
    vertices, faces = mesh
    centre = vertices.astype(np.float64).mean(axis=0)
    radius = np.ptp(vertices[:, 0]) / 2
    offsets = 0.3 * radius * rng.uniform(-1, 1, (3 * COUNT, 3))
    origins = (centre + offsets).astype(np.float32)
    corners = vertices[rng.choice(faces, COUNT)].astype(np.float64)
    a, b = corners[:, 0], corners[:, 1]
    targets = [a, (a + b) / 2, a + rng.uniform(size=(COUNT, 1)) * (b - a)]
    return origins, np.concatenate(targets).astype(np.float32) - origins


@each_core
@pytest.mark.parametrize("options", TRACED.values(), ids=TRACED)
@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_no_ray_escapes(core: ModuleType, mesh: workloads.Scene, options: Options) -> None:
    rng = np.random.default_rng(SEED)
    rays = rays_from_inside(rng, mesh)
    found = closest(build(core, mesh), rays, options)
    escaped = np.flatnonzero(found.face < 0)
    assert escaped.size == 0, f"{escaped.size} rays escape (seed {SEED}): {escaped[:5]}..."


@each_core
@pytest.mark.parametrize("options", TRACED.values(), ids=TRACED)
def test_fan_has_no_gap_at_its_spokes(core: ModuleType, options: Options) -> None:
    vertices, faces = workloads.fan()
    rng = np.random.default_rng(SEED)
    share = rng.integers(0, 512, (COUNT, 1)) / 512
    rim = vertices[1:][rng.integers(0, len(vertices) - 1, COUNT)]
    targets = (share * rim).astype(np.float32)
    origins = workloads.snap(rng.uniform((-1, -1, 3), (1, 1, 5), (COUNT, 3)))
    found = closest(build(core, (vertices, faces)), (origins, targets - origins), options)
    # Targets are rounded, but those within the rim have slivers on all sides.
    inside = share[:, 0] < 0.9
    assert inside.sum() > COUNT // 2
    assert (found.face[inside] >= 0).all()
