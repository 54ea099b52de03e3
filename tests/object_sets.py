"""Object sets of the core without a scene, and rays against them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin._dispatch import core

Array = npt.NDArray[Any]
EMPTY = core.KdTree(np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32))


def object_set(
    types: list[int], frames: list[Array], groups: Sequence[Any] = (), **instances: Any
) -> Any:
    """An object set of the core, by default without instances."""
    count = len(instances.get("instance_groups", ()))
    maps = np.asarray(instances.get("maps", np.zeros((0, 3, 4))), np.float64)
    linear = np.linalg.inv(maps[:, :, :3]).transpose(0, 2, 1) if count else maps[:, :, :3]
    return core.Objects(
        np.array(types, np.uint32),
        np.array(frames, np.float64).reshape(-1, 3, 4),
        instances.get("scene_count", len(types)),
        list(groups),
        np.array(instances.get("instance_groups", ()), np.uint32),
        maps,
        np.ascontiguousarray(linear),
        instances.get("first_face", 0),
    )


def closest(
    objects: Any, origins: Array, directions: Array, t_max: float = math.inf
) -> tuple[Array, Array, Array]:
    ends = np.zeros(len(origins), np.float32), np.full(len(origins), t_max, np.float32)
    t, face, instance, _, _ = objects.closest_hit(EMPTY, origins, directions, *ends, {})
    hidden = objects.any_hit(EMPTY, origins, directions, *ends, {})
    np.testing.assert_array_equal(hidden, face >= 0)
    return t, face, instance
