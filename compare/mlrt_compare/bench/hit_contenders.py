"""Who is asked for hits of single rays: MLRT, and Embree in its default and robust mode."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin import KdTree

from .contenders import EMBREE, MLRT, embree_device
from .native import Native

FloatArray = npt.NDArray[np.float32]
HitArrays = tuple[FloatArray, npt.NDArray[np.int64]]
"""Distances (N,), inf for a miss, and faces (N,), -1 for one."""

BACKGROUND = 0xFFFFFFFF
TRAVERSALS = {
    MLRT: "adaptive",
    f"{MLRT}, wide tree": "wide",
    f"{MLRT}, single rays": "single",
}
"""MLRT as usual, and each ray alone, through either tree."""


@dataclass(frozen=True)
class HitContender:
    """Called with origins and directions, (N, 3) float32."""

    name: str
    closest_hit: Callable[[FloatArray, FloatArray], HitArrays]


def hit_contenders(
    native: Native, vertices: FloatArray, faces: npt.NDArray[np.uint32], threads: int
) -> list[HitContender]:
    """MLRT first, by each of TRAVERSALS. Embree is asked in packets of 16, as Mitsuba asks
    it, of scenes of build quality MEDIUM, which is Mitsuba's."""
    tree = KdTree(vertices, faces)

    def mlrt(traversal: str) -> Callable[[FloatArray, FloatArray], HitArrays]:
        def closest_hit(origins: FloatArray, directions: FloatArray) -> HitArrays:
            hits = tree.closest_hit(origins, directions, traversal=traversal)
            return hits.t, hits.primitive.astype(np.int64)

        return closest_hit

    mesh = native.module.Mesh(vertices, faces)
    own = [HitContender(name, mlrt(traversal)) for name, traversal in TRAVERSALS.items()]
    return [*own, *embree_contenders(native, mesh, threads)]


def embree_contenders(native: Native, mesh: Any, threads: int) -> list[HitContender]:
    """Embree in its default and in its robust mode; `mesh` is one of the native side."""
    device = embree_device(native.module, threads)

    def embree(robust: bool) -> Callable[[FloatArray, FloatArray], HitArrays]:
        scene: Any = native.module.EmbreeScene(device, mesh, False, robust)

        def closest_hit(origins: FloatArray, directions: FloatArray) -> HitArrays:
            t = np.zeros(len(origins), np.float32)
            face = np.zeros(len(origins), np.uint32)
            scene.closest_hit(origins, directions, t, face)
            return t, np.where(face == BACKGROUND, -1, face.astype(np.int64))

        return closest_hit

    return [
        HitContender(f"{EMBREE} default", embree(False)),
        HitContender(f"{EMBREE} robust", embree(True)),
    ]
