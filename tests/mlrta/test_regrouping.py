"""Rays that can be cut apart again and again: neither the stack nor the work grows with it.

Slopes that fall off as powers do leave a gap beside the greatest one, whatever rays are
left: each cut takes off a ray or two. A beam of 256 rays could be cut that way down to
one packet.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from tracing import BRUTE_FORCE, Options, build, closest, each_core, interval, occluded

SEED = 20_261_128
HERE = Path(__file__).parent
BEAM, COUNT = 256, 138
MOST_REGROUPINGS = 16
"""As in beam_tracer.h."""
RATIO = 0.61
"""Of one slope to the next: the greatest then lies in the last of eight cells, the others
in the first five, so that three quarters of the rectangle hold all."""
SMALLEST_SLOPE = 2.0**-100
"""Rays with smaller ones do not go along."""
SMALL_STACK = 1 << 20

FloatArray = npt.NDArray[np.float32]
OPTIONS: dict[str, Options] = {
    name: {"traversal": name, "entry_points": False} for name in ("beam_leaf", "adaptive")
}


def adversarial(rng: np.random.Generator) -> tuple[workloads.Scene, FloatArray]:
    """A soup on both sides of the origin, and directions: three beams one way, from which
    the next one learns that narrow ones pay, and the one that is cut ray by ray."""
    fan = np.stack([rng.uniform(0, 2, 3 * BEAM), rng.uniform(-0.01, 0.01, 3 * BEAM)], 1)
    fan = np.hstack([fan[np.argsort(fan[:, 0])], np.full((3 * BEAM, 1), -1)])
    slopes = 2 * RATIO ** np.arange(COUNT)
    assert slopes[-1] > SMALLEST_SLOPE
    powers = np.stack([slopes, np.zeros(COUNT), np.ones(COUNT)], 1)
    powers = np.concatenate([powers, powers[: BEAM - COUNT]])
    count = 3000
    centres = np.stack(
        [rng.uniform(0, 2, count), rng.uniform(-0.02, 0.02, count), np.ones(count)], 1
    ) * rng.uniform(1, 1.5, (count, 1))
    centres = np.concatenate([centres, centres * [1, 1, -1]])
    corners = centres[:, None] + rng.uniform(-0.1, 0.1, (2 * count, 3, 3))
    scene = (
        corners.reshape(-1, 3).astype(np.float32),
        np.arange(6 * count, dtype=np.uint32).reshape(-1, 3),
    )
    return scene, np.concatenate([fan, powers]).astype(np.float32)


@each_core
@pytest.mark.parametrize("name", OPTIONS)
def test_rays_are_regrouped_a_bounded_number_of_times(core: ModuleType, name: str) -> None:
    print("seed", SEED)
    scene, directions = adversarial(np.random.default_rng(SEED))
    tree = build(core, scene)
    rays = np.zeros_like(directions), directions
    counters: dict[str, int] = {}
    tree.closest_hit(*rays, *interval(rays, 0, np.inf), OPTIONS[name], counters)
    # By one or two, 256 + 254 + ... + 17 would be regrouped, 17,000 rays or so.
    assert counters["regrouped_rays"] <= MOST_REGROUPINGS * BEAM
    assert counters["regrouped_rays"] > 8 * BEAM, "the case that this is about"
    expected = closest(tree, rays, BRUTE_FORCE)
    closest(tree, rays, OPTIONS[name]).assert_same(expected)
    assert np.array_equal(occluded(tree, rays, OPTIONS[name]), expected.face >= 0)
    assert np.count_nonzero(expected.face >= 0) > 900


@each_core
@pytest.mark.parametrize("name", OPTIONS)
def test_rays_in_all_directions_and_sizes(core: ModuleType, name: str) -> None:
    """Rays that do not go along with the others are set apart, and again of those."""
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 500, 0.2)
    tree = build(core, scene)
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    count = 8 * BEAM
    directions = axes[rng.integers(6, size=count)] + rng.uniform(-0.1, 0.1, (count, 3))
    directions *= 2.0 ** rng.integers(-80, 80, (count, 1))
    origins = np.broadcast_to(np.float32([0.5, 0.5, 0.5]), directions.shape)
    rays = np.ascontiguousarray(origins), directions.astype(np.float32)
    counters: dict[str, int] = {}
    tree.closest_hit(*rays, *interval(rays, 0, np.inf), OPTIONS[name], counters)
    assert 0 < counters["regrouped_rays"] <= MOST_REGROUPINGS * len(directions)
    expected = closest(tree, rays, BRUTE_FORCE)
    closest(tree, rays, OPTIONS[name]).assert_same(expected)


def test_a_small_stack_is_enough() -> None:
    """A cut for each slope would take more than twice as much."""
    code = (
        "import numpy as np, test_regrouping as t\n"
        "from tracing import CORES, build, closest, occluded\n"
        "scene, directions = t.adversarial(np.random.default_rng(t.SEED))\n"
        "rays = np.zeros_like(directions), directions\n"
        "for core in CORES:\n"
        "    tree = build(core, scene)\n"
        "    for options in t.OPTIONS.values():\n"
        "        closest(tree, rays, options), occluded(tree, rays, options)\n"
    )
    hard = resource.getrlimit(resource.RLIMIT_STACK)[1]
    child = subprocess.run(
        [
            sys.executable,
            "-P",
            "-c",
            code,
        ],  # the package that is tested here, not its sources
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": os.pathsep.join((*sys.path, str(HERE)))},
        # Threads that are started later take it as well.
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (SMALL_STACK, hard)),
    )
    assert child.returncode == 0, child.stderr
