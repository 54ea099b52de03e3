"""The control: the same rays in groups of neighbours, and in random ones.

Whatever a grouping costs, it must find the same hits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..bench.camera_rays import Rays, camera_rays, morton_order
from ..bench.status import show_status
from .counts import PACKET_RAYS, counts_of
from .scenes import StudiedScene
from .ways import PACKET, PACKET_WITHOUT, PAPER, WITHOUT

WAYS = (WITHOUT, PAPER, PACKET_WITHOUT, PACKET)
BEFORE_THE_HIT = 1 - 2.0**-10
"""Where shadow rays end, of their length, so that they do not meet what was hit; chosen."""
SEED = 1
TILE_RAYS, RANDOM_RAYS = 2**14, 2**11
"""Traced at most in random order within tiles, and from anywhere; chosen. One interval for
rays that go apart visits most of the tree, so that few must do."""
TILE_WORK, RANDOM_WORK, LEAST_RAYS = 2**33, 2**30, 2**8
"""Rays times triangles of these groups, where that is not fewer than the least; chosen, so
that millions of triangles take seconds."""


def shadow_rays(
    rays: Rays, t: npt.NDArray[np.float32], light: npt.NDArray[np.float32]
) -> Rays:
    """From the light to where rays hit, in their order. ``t``: (N,) of the hits, inf for
    none, whose shadow rays are inactive."""
    hit = np.isfinite(t)
    reach = np.where(hit, t, 0)[:, None]
    directions = (rays.origin + reach * rays.directions - light).astype(np.float32)
    t_max = np.where(hit, BEFORE_THE_HIT, 0).astype(np.float32)
    return Rays(light, directions, np.zeros_like(t_max), t_max)


def groupings(
    side: int, tile: int, seed: int, triangles: int
) -> dict[str, npt.NDArray[np.int64]]:
    """Orders of pixels of a square film, by name: all of them with neighbours together, in
    Morton order; tiles that are chosen at random, the rays of each in random order; and
    rays that are chosen at random.

    tile: rays along the side of a tile. triangles: of the scene; the more, the fewer rays
    in random groups.
    """
    random = np.random.default_rng(seed)
    neighbours = morton_order(side)
    tiles = neighbours[: len(neighbours) // tile**2 * tile**2].reshape(-1, tile**2)
    of_tiles = min(TILE_RAYS, TILE_WORK // triangles)
    anywhere = min(RANDOM_RAYS, max(RANDOM_WORK // triangles, LEAST_RAYS))
    anywhere -= anywhere % PACKET_RAYS
    chosen = random.permutation(tiles)[: max(of_tiles // tile**2, 1)]
    return {
        "neighbours": neighbours,
        "random within tiles": random.permuted(chosen, axis=1).ravel(),
        "random": random.permutation(neighbours)[:anywhere],
    }


def compare_groupings(studied: StudiedScene) -> dict[str, Any]:
    """Counts of each way with each grouping, and whether each ray has the same hit and
    shadow in all of them. There is a shadow ray to each hit."""
    tree = studied.lit.tree
    rays = camera_rays(studied.lit.arrays.camera, studied.side)
    everything = np.arange(studied.rays)
    t, primitive = tree.closest_hit(*rays.ordered(everything), PACKET.options)[:2]
    light = np.array(studied.scene.view["light"], np.float32)
    shadows = shadow_rays(rays, t, light)
    occluded = tree.any_hit(*shadows.ordered(everything), PACKET.options)

    same = True
    result: dict[str, Any] = {}
    tile = min(int(PAPER.options["minimum_tile"]), studied.side)
    triangles = len(studied.scene.faces)
    for name, order in groupings(studied.side, tile, SEED, triangles).items():
        result[name] = {"rays": len(order), "ways": {}}
        for way in WAYS:
            show_status(f"{studied.scene.name}: {name}, {way.name}")
            primary: dict[str, int] = {}
            shadow: dict[str, int] = {}
            hits = tree.closest_hit(*rays.ordered(order), way.options, primary)
            dark = tree.any_hit(*shadows.ordered(order), way.options, shadow)
            same &= np.array_equal(hits[0], t[order])
            same &= np.array_equal(hits[1], primitive[order])
            same &= np.array_equal(dark, occluded[order])
            counters = {
                **{f"primary_{key}": value for key, value in primary.items()},
                **{f"shadow_{key}": value for key, value in shadow.items()},
            }
            result[name]["ways"][way.key] = {
                kind: counts_of(counters, kind, len(order)).as_dict()
                for kind in ("primary", "shadow", "primary_and_shadow")
            }
    show_status("")
    return {"seed": SEED, "groupings": result, "same_hits": bool(same)}
