"""Names of the native core's options, told apart by the step that they belong to."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

from .errors import SceneError

TRACE_OPTIONS = (
    "traversal",
    "entry_points",
    "initial_tile",
    "minimum_tile",
    "split_factor",
    "leaf_rejection",
    "culling",
    "search_order",
    "frontier",
    "covering_triangles",
)
"""Fields of ``TraceOptions`` in ``cpp/mlrta/trace.h``."""

BUILD_OPTIONS = (
    "builder",
    "traversal_cost",
    "intersection_cost",
    "empty_bonus",
    "clip",
    "rule_empty_cell",
    "rule_flat_cell",
    "rule_area_floor",
    "empty_cell_share",
    "area_floor",
    "max_depth",
)
"""Fields of ``BuildOptions`` in ``cpp/kdtree/builder.h``."""

BUILDERS = ("auto", "exact", "fast", "lazy")
"""Values of the option ``builder``."""

INTEGRATOR_OPTIONS = (
    *TRACE_OPTIONS,
    *(name for name in BUILD_OPTIONS if name != "max_depth"),
)
"""Those that the integrator `mlrt` takes as parameters: by ``max_depth`` Mitsuba's
integrators mean the length of paths."""

SHADOW_OFFSETS = ("mitsuba", "robust")
"""Values of the option ``shadow_offset``: ``cpp/render/shadow_offset.h``."""

AOVS = ("depth", "normal", "prim", "cost", "moment")
"""Images that can be had beside the colours: `cost` natively only."""


def integer(value: object, name: str) -> int:
    """A whole number; raises TypeError, which names the argument, for anything else."""
    try:
        return operator.index(value)  # type: ignore[arg-type]
    except TypeError:
        raise TypeError(f"{name} must be a whole number, not {value!r}") from None


def checked_resolution(resolution: Sequence[object]) -> tuple[int, int]:
    """A (width, height) in pixels; raises ValueError or TypeError for what is none, and
    SceneError for one that is too small."""
    if isinstance(resolution, str) or len(resolution) != 2:
        raise ValueError(f"resolution must be (width, height), not {resolution!r}")
    width, height = resolution
    checked = integer(width, "width"), integer(height, "height")
    if min(checked) < 1:
        raise SceneError(
            f"resolution {checked[0]}x{checked[1]} is too small: both must be at least 1"
        )
    return checked


def split_options(params: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Tells options of building from options of tracing.

    Raises TypeError for a name that is neither.
    """
    unknown = sorted(set(params) - set(TRACE_OPTIONS) - set(BUILD_OPTIONS))
    if unknown:
        known = ", ".join((*TRACE_OPTIONS, *BUILD_OPTIONS))
        raise TypeError(f"unknown option '{unknown[0]}': choose from {known}")
    build = {name: value for name, value in params.items() if name in BUILD_OPTIONS}
    trace = {name: value for name, value in params.items() if name in TRACE_OPTIONS}
    return build, trace
