"""All ways through the tree agree bit for bit on the rays of real scenes.

`pytest --full` traces 2^20 camera rays and the shadow rays of their hits, and 20,000 of
them without the tree; otherwise a sixteenth of that.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import repository

from mlrt_plugin import KdTree
from mlrt_plugin.scene_arrays import SceneArrays
from mlrt_plugin.scene_import import import_scene
from mlrt_plugin.tree import Hits

PATHS = [
    {"traversal": "single", "entry_points": False},
    {"traversal": "packet", "entry_points": False},
    {"traversal": "interval", "entry_points": False},
    {"traversal": "packet", "initial_tile": 128, "minimum_tile": 32},
    {"traversal": "packet", "initial_tile": 64, "minimum_tile": 4, "split_factor": 16},
    {"traversal": "interval", "minimum_tile": 8, "leaf_rejection": "parameters"},
    {"traversal": "packet", "minimum_tile": 8, "culling": "frustum_planes"},
]

# These look for the wide tree, which is there once it is asked for or enough rays came.
WIDE_PATHS = [{"traversal": name} for name in ("beam_leaf", "adaptive", "wide")]

OWN = ["cornell-box/cornell-box.xml", "office/office.xml"]
THIRD_PARTY = [
    "conference/conference.xml",
    "sponza/sponza.xml",
    "bunny/bunny.xml",
    "toasters/toasters.xml",
    "dragon/dragon.xml",
    "living-room/scene_direct.xml",
]


def camera_rays(
    scene: SceneArrays, side: int
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Rays through the centres of side x side pixels, in Morton order: packets and tiles
    are then squares of the film. They share their origin; t is depth."""
    index = np.arange(side * side)
    x = np.zeros_like(index)
    y = np.zeros_like(index)
    for bit in range(side.bit_length()):
        x |= ((index >> (2 * bit)) & 1) << bit
        y |= ((index >> (2 * bit + 1)) & 1) << bit
    axes = np.array(scene.camera.axes)
    across = (1 - 2 * (x + 0.5) / side) * scene.camera.tan_half_fov_x
    down = (1 - 2 * (y + 0.5) / side) * scene.camera.tan_half_fov_x
    direction = across[:, None] * axes[0] + down[:, None] * axes[1] + axes[2]
    origin = np.broadcast_to(np.float32(scene.camera.origin), direction.shape)
    near, far = scene.camera.near_clip, scene.camera.far_clip
    return origin, direction.astype(np.float32), near, far


def assert_same(hits: Hits, reference: Hits, what: object) -> None:
    for name, ours, theirs in zip(Hits._fields, hits, reference, strict=True):
        differing = np.flatnonzero(ours.view(np.uint32) != theirs.view(np.uint32))
        assert differing.size == 0, (
            f"{what}: {name} of {differing.size} rays differs, first ray {differing[0]}: "
            f"{ours[differing[0]]} and {theirs[differing[0]]}"
        )


def shadow_rays(
    points: np.ndarray, light: np.ndarray, extent: np.ndarray
) -> list[tuple[np.ndarray, np.ndarray, float, float]]:
    """From a light to points (a common origin), from a lamp around it (an origin each, and
    little between), on from the points (none), and from them to a sun (one direction)."""
    rng = np.random.default_rng(8)
    lamp = (light + rng.random(points.shape) * 0.02 * extent).astype(np.float32)
    sun = np.tile(np.float32([0.3, 0.8, 0.2]), (len(points), 1))
    return [
        (np.broadcast_to(light, points.shape), points - light, 1e-3, 0.999),
        (lamp, points - lamp, 1e-3, 0.999),
        (points, light - points, 1e-3, 0.999),
        (points, sun, 1e-3, np.inf),
    ]


def check(path: Path, full: bool) -> None:
    scene = import_scene(path)
    tree = KdTree(scene.vertices, scene.faces)
    origin, direction, near, far = camera_rays(scene, 1024 if full else 256)
    reference = tree.closest_hit(origin, direction, near, far, **PATHS[0])
    hit = reference.primitive >= 0
    assert hit.any()
    for options in PATHS[1:]:
        assert_same(
            tree.closest_hit(origin, direction, near, far, **options), reference, options
        )
    # Brute force shares nothing with the tree but the decision on a single triangle.
    rng = np.random.default_rng(7)
    some = rng.choice(len(origin), 20_000 if full else 500, replace=False)
    brute = tree.closest_hit(
        origin[some],
        direction[some],
        near,
        far,
        traversal="brute_force",
    )
    assert_same(brute, Hits(*(values[some] for values in reference)), "brute force")

    points = origin[hit] + reference.t[hit, None] * direction[hit]
    light = np.float32(scene.camera.origin) + np.float32([0.1, 0.2, 0.3])
    shadows = shadow_rays(points, light, np.ptp(scene.vertices, axis=0))
    expected = [tree.closest_hit(*rays, **PATHS[0]).primitive >= 0 for rays in shadows]
    some = rng.choice(len(points), 5_000 if full else 100, replace=False)
    for (start, along, *interval), occluded in zip(shadows, expected, strict=True):
        brute = tree.any_hit(start[some], along[some], *interval, traversal="brute_force")
        assert np.array_equal(brute, occluded[some]), "brute force"

    def check_shadows(options: dict[str, object], what: str = "") -> None:
        for rays, occluded in zip(shadows, expected, strict=True):
            assert np.array_equal(tree.any_hit(*rays, **options), occluded), (options, what)

    for options in PATHS:
        check_shadows(options)
    for widened in ("as it comes", "widened"):
        if widened == "widened":
            tree.widen()
        for options in WIDE_PATHS:
            found = tree.closest_hit(origin, direction, near, far, **options)
            assert_same(found, reference, (options, widened))
            check_shadows(options, widened)


@pytest.mark.parametrize("name", OWN)
def test_own_scenes(name: str, full: bool) -> None:
    check(repository.ROOT / "scenes" / name, full)


@pytest.mark.parametrize("name", THIRD_PARTY)
def test_third_party_scenes(
    name: str, full: bool, shared_scene: Callable[[str], Path]
) -> None:
    if name.startswith("dragon") and not full:
        pytest.skip("the largest scene is for --full")
    check(shared_scene(name), full)
