"""The tiles of an image and where their rays enter the kd-tree, to look at."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .errors import MlrtError
from .options import integer
from .render import Prepared, PreparedScene

SEARCH_OPTIONS = ("culling", "leaf_rejection", "search_order", "covering_triangles")
"""Those of `mlrt_plugin.options.TRACE_OPTIONS` that a search follows."""
LEAF = 3
"""In the two low bits of a node: it is a leaf (``cpp/kdtree/node.h``)."""
SMALLEST_TILE = 4
"""Pixels along the side of a packet, which is never split."""


@dataclass(frozen=True)
class ImageTile:
    """A rectangle of pixels, and the deepest node that all its rays may start at."""

    x: int
    y: int
    width: int
    height: int
    """In pixels of the image; (x, y) is the upper left one."""
    split: bool
    """Whether it is dealt out to smaller tiles, which follow it."""
    node: int | None
    """Number of the entry point; None if no ray of the tile can hit anything."""
    depth: int | None
    """Of the entry point, in nodes below the root."""
    cell: npt.NDArray[np.float32] | None
    """(2, 3) lower and upper corner of the entry point's cell in world space."""


def image_tiles(
    prepared: Prepared,
    *,
    initial_tile: int = 64,
    minimum_tile: int = 16,
    split_factor: int = 4,
    **options: Any,
) -> list[ImageTile]:
    """All tiles of a scene's image, a tile before its parts.

    They are dealt out as rays are at one sample a pixel: squares of `initial_tile` pixels,
    split until they have at most `minimum_tile` along a side, or until their entry point is
    a leaf and cannot get deeper (Reshetov, Soupikov and Hurley 2005, section 3). Each has
    one entry point, searched from the root for the beam of its rectangle. Of a lazy tree
    only what rays have built so far counts.

    initial_tile, minimum_tile: powers of two from 4 on. split_factor: 4 or 16.
    options: those of `SEARCH_OPTIONS`.

    Raises MlrtError for a scene that Mitsuba shades, whose rays are not known here, and for
    sizes that make no sense; TypeError for an unknown option.
    """
    if not isinstance(prepared, PreparedScene):
        raise MlrtError(
            "tiles are known of scenes that are shaded natively only: this one is shaded "
            f"by {prepared.shading}"
        )
    sizes = {"initial_tile": initial_tile, "minimum_tile": minimum_tile}
    for name, size in sizes.items():
        side = integer(size, name)
        if side < SMALLEST_TILE or side & (side - 1):
            raise MlrtError(f"{name} = {side} is no power of two from {SMALLEST_TILE} on")
    if integer(split_factor, "split_factor") not in (4, 16):
        raise MlrtError(f"split_factor = {split_factor} does not exist: choose 4 or 16")
    for name in options:
        if name not in SEARCH_OPTIONS:
            known = ", ".join(SEARCH_OPTIONS)
            raise TypeError(f"unknown option '{name}': choose from {known}")
    film = prepared.arrays.film
    search = entry_point_search(prepared, options)

    def tiles_in(x: int, y: int, side: int) -> Iterator[ImageTile]:
        width, height = min(side, film.crop_width - x), min(side, film.crop_height - y)
        if width <= 0 or height <= 0:
            return
        node, depth, cell, is_leaf = search(x, y, width, height)
        split = node is not None and not is_leaf and side > minimum_tile
        yield ImageTile(x, y, width, height, split, node, depth, cell)
        if split:
            parts = 2 if split_factor == 4 else 4
            step = max(side // parts, SMALLEST_TILE)
            for below in range(0, side, step):
                for right in range(0, side, step):
                    yield from tiles_in(x + right, y + below, step)

    return [
        tile
        for y in range(0, film.crop_height, initial_tile)
        for x in range(0, film.crop_width, initial_tile)
        for tile in tiles_in(x, y, initial_tile)
    ]


EntryPoint = tuple[int | None, int | None, "npt.NDArray[np.float32] | None", bool]
"""Node, depth, cell, and whether the node is a leaf."""


def entry_point_search(
    prepared: PreparedScene, options: dict[str, Any]
) -> Callable[[int, int, int, int], EntryPoint]:
    """A function of a rectangle (x, y, width, height) of the image."""
    arrays = prepared.arrays
    camera, film = dataclasses.asdict(arrays.camera), dataclasses.asdict(arrays.film)
    left, top = arrays.film.crop_x, arrays.film.crop_y
    depths, leaves = node_depths(core.tree_nodes(prepared.tree))

    def search(x: int, y: int, width: int, height: int) -> EntryPoint:
        rectangle = (left + x, top + y, width, height)
        entry = core.entry_point(prepared.tree, camera, film, rectangle, options)
        if entry is None:
            return None, None, None, False
        node, low, high = entry
        cell = np.array((low, high), np.float32)
        return node, int(depths[node]), cell, bool(leaves[node])

    return search


def node_depths(
    nodes: npt.NDArray[np.uint32],
) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.bool_]]:
    """Nodes above each node (N,), and which nodes are leaves, of (N, 2) as
    ``cpp/kdtree/node.h`` lays them out; -1 for nodes that are not used."""
    leaves = (nodes[:, 1] & 3) == LEAF
    lower = nodes[:, 1] >> 2
    depths = np.full(len(nodes), -1, np.int32)
    level, depth = np.zeros(1, np.uint32), 0
    while len(level):
        depths[level] = depth
        below = lower[level[~leaves[level]]]
        level, depth = np.concatenate((below, below + 1)), depth + 1
    return depths, leaves
