"""The command ``mlrt tree``: builds the tree of a scene and tells what it is like."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .errors import SceneError
from .options import BUILD_OPTIONS, BUILDERS
from .peak_memory import PeakMemory
from .scene_arrays import Lighting, SceneArrays
from .scene_import import import_scene
from .shading_choice import choose_shading
from .threads import thread_count
from .tree_cache import obtain_tree
from .tree_report import dropped_by_mesh, invisible_meshes, report_lines, tree_report

HELP = {
    "builder": "exact: the best tree; fast: nearly as good, on all threads; lazy: that of "
    "fast, built where rays go; auto: exact below 65536 triangles, else fast",
    "traversal_cost": "cost of a step through an inner node",
    "intersection_cost": "cost of a test of a triangle",
    "empty_bonus": "factor on the cost of splits that cut off empty space",
    "clip": "clip triangles to cells",
    "rule_empty_cell": "cut off large empty cells first (rule 1)",
    "rule_flat_cell": "give triangles that cover a plane a flat cell (rule 2)",
    "rule_area_floor": "leave small cells whole (rule 3)",
    "empty_cell_share": "least share of a cell that rule 1 cuts off",
    "area_floor": "share of the scene's surface area below which rule 3 leaves a cell "
    "whole; 0 chooses it by the size of the triangles",
    "max_depth": "inner nodes on a path; 0 limits them by the number of triangles",
}
"""What the options of the builder are."""


def folder(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("the name of the folder is empty")
    return Path(text)


def add_tree_cache(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--tree-cache",
        type=folder,
        metavar="DIR",
        help="folder that trees are kept in for the next time",
    )


def add_build_options(
    parser: argparse.ArgumentParser, names: Sequence[str] = BUILD_OPTIONS
) -> None:
    """A flag for each of some build options, by the type of its default."""
    group = parser.add_argument_group("options of the builder")
    for name, default in core.build_options().items():
        if name not in names:
            continue
        kwargs: dict[str, Any]
        if isinstance(default, bool):
            kwargs = {"action": argparse.BooleanOptionalAction}
            shown = "on" if default else "off"
        elif isinstance(default, str):
            kwargs = {"choices": BUILDERS}
            shown = default
        else:
            kwargs = {"type": type(default), "metavar": "N"}
            shown = f"{default:g}"
        kwargs["help"] = f"{HELP[name]} (default: {shown})"
        group.add_argument(f"--{name.replace('_', '-')}", default=None, **kwargs)


def build_options_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The options that were given; the others keep the builder's default."""
    given = {name: getattr(arguments, name, None) for name in BUILD_OPTIONS}
    return {name: value for name, value in given.items() if value is not None}


@dataclass(frozen=True)
class TreeScene:
    """What a tree is built of, natively or for Mitsuba to shade.

    arrays: of a native scene.
    """

    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    lighting: Lighting
    warnings: tuple[str, ...]
    arrays: SceneArrays | None = None


NO_MESH = "has no triangle meshes outside of groups, and so no tree"


def scene_of_tree(arguments: argparse.Namespace) -> TreeScene:
    """Reads the scene that is named; raises SceneError if it has no triangles."""
    what: dict[str, Any] = {
        "sensor": arguments.sensor,
        "defines": dict(arguments.define),
    }
    choice = choose_shading(arguments.scene, **what)
    if choice.path == "native":
        arrays = import_scene(arguments.scene, **what, force_direct=True)
        if not len(arrays.faces):
            raise SceneError(f"{arguments.scene} {NO_MESH}")
        return TreeScene(
            arrays.vertices, arrays.faces, arrays.lighting, arrays.warnings, arrays
        )
    # Not loaded where it is not used: Mitsuba's llvm variant takes a while.
    from .hybrid.hit_scene import mesh_faces
    from .hybrid.loading import load_scene

    loaded = load_scene(arguments.scene, reason=choice.reason, **what, force_direct=True)
    faces = mesh_faces(loaded.shapes, loaded.names)
    if faces is None:
        raise SceneError(f"{arguments.scene} {NO_MESH}")
    geometry = faces.geometry
    warnings = (*loaded.warnings, *geometry.warnings)
    return TreeScene(geometry.vertices, geometry.faces, loaded.lighting, warnings)


def run_tree(arguments: argparse.Namespace) -> None:
    with thread_count(arguments.threads):
        start = time.perf_counter()
        scene = scene_of_tree(arguments)
        loaded = time.perf_counter()
        with PeakMemory() as peak:
            obtained = obtain_tree(
                scene.vertices,
                scene.faces,
                {
                    **scene.lighting.own_options(BUILD_OPTIONS),
                    **build_options_of(arguments),
                },
                arguments.tree_cache,
            )
        tree = obtained.tree
        report = {**tree_report(tree), "peak_bytes": peak.bytes}
    warnings = scene.warnings + obtained.warnings
    dropped: dict[str, int] = {}
    if scene.arrays is not None:
        warnings += invisible_meshes(tree, scene.arrays)
        dropped = dropped_by_mesh(tree, scene.arrays)
    for message in warnings:
        print(f"mlrt: warning: {message}", file=sys.stderr)
    options = core.tree_options(tree)
    timings = {"load": loaded - start, **obtained.timings}
    if arguments.json:
        figures = {
            "scene": str(arguments.scene),
            "options": options,
            **report,
            "dropped_by_mesh": dropped,
            "timings": timings,
        }
        print(json.dumps(figures, indent=2))
        return
    lines = report_lines(report)
    if dropped:
        lines.append("Dropped triangles:")
        lines += [f"   {count} of {name}" for name, count in dropped.items()]
    seconds = ", ".join(f"{name} {value:.3f} s" for name, value in timings.items())
    lines.append(f"{arguments.scene}: {seconds}")
    if arguments.verbose:
        lines += [f"  {name}: {value}" for name, value in {**options, **report}.items()]
    print("\n".join(lines))
