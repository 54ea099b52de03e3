"""What a tree is like: as numbers, and in the words of Mitsuba's kd-tree log."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .scene_arrays import SceneArrays
from .tree_files import NODE_SIZE, REFERENCE_SIZE

TRIANGLE_SIZE = 36
"""Bytes: three vertices in single precision."""


def tree_report(tree: Any) -> dict[str, Any]:
    """Figures of a tree of the core: what its builder counted, and what a walk finds.

    nodes, inner_nodes, leaves; empty_leaves, without references; flat_leaves, with
    references and a cell that has no extent along an axis; depth, inner nodes on the
    longest path. triangles, dropped_triangles: as given, and those of them that are not
    finite or have no area. references; references_per_triangle that is not dropped;
    references_per_nonempty_leaf, max_leaf_count; leaf_histogram, leaves with 0, 1, ... 15
    references. empty_cell_splits, flat_cell_splits, area_floor_leaves: by the paper's
    rules 1, 2 and 3. expected_traversals, expected_leaf_visits and
    expected_primitive_visits of a line that crosses the root's cell, and sah_cost, its
    expected cost in units of one traversal. node_bytes, reference_bytes, triangle_bytes,
    waiting_bytes that are kept to build the rest of a lazy tree, wide_bytes of the form for
    rays that go alone, 0 as long as there is none, and their sum total_bytes.
    seconds that building took, once, and of its phases.

    Of a lazy tree the figures are those of the part that is built; of its seconds, those
    before the first ray. unbuilt_cells and unbuilt_references are what is left to build;
    built_share is the least share of the triangles that is in none of these cells, the
    least because a triangle may be in several.
    """
    options = core.tree_options(tree)
    report: dict[str, Any] = {**tree.report, **core.tree_statistics(tree)}
    triangles = len(core.tree_triangles(tree))
    kept = triangles - report["dropped_triangles"]
    nonempty = report["leaves"] - report["empty_leaves"]
    report["nodes"] = report["inner_nodes"] + report["leaves"] + report["unbuilt_cells"]
    report["triangles"] = triangles
    left = min(report["unbuilt_references"], kept)
    report["built_share"] = 1 - left / kept if kept else 1.0
    report["references_per_triangle"] = report["references"] / max(1, kept)
    report["references_per_nonempty_leaf"] = report["references"] / max(1, nonempty)
    report["sah_cost"] = (
        report["expected_traversals"]
        + options["intersection_cost"]
        / options["traversal_cost"]
        * report["expected_primitive_visits"]
    )
    report["node_bytes"] = len(core.tree_nodes(tree)) * NODE_SIZE
    report["reference_bytes"] = len(core.tree_references(tree)) * REFERENCE_SIZE
    report["triangle_bytes"] = triangles * TRIANGLE_SIZE
    report["total_bytes"] = (
        report["node_bytes"]
        + report["reference_bytes"]
        + report["triangle_bytes"]
        + report["waiting_bytes"]
        + report["wide_bytes"]
    )
    return report


def dropped_by_shape(tree: Any, arrays: SceneArrays) -> npt.NDArray[np.int64]:
    """How many triangles of each shape are not finite or have no area."""
    firsts = [shape.first_face for shape in arrays.shapes]
    owners = np.searchsorted(firsts, core.tree_dropped(tree), side="right") - 1
    return np.bincount(owners, minlength=len(firsts))


def shape_name(arrays: SceneArrays, number: int) -> str:
    return arrays.shape_names[number] if arrays.shape_names else f"shape {number}"


def dropped_by_mesh(tree: Any, arrays: SceneArrays) -> dict[str, int]:
    """The same by the names of the meshes, where there are any."""
    counts: dict[str, int] = {}
    for number, count in enumerate(dropped_by_shape(tree, arrays)):
        if count:
            name = shape_name(arrays, number)
            counts[name] = counts.get(name, 0) + int(count)
    return counts


def invisible_meshes(tree: Any, arrays: SceneArrays) -> tuple[str, ...]:
    """A sentence on each mesh that no ray hits because its faces have no area.

    Faces without an area are common, and not worth a word where there are others. Those
    that are not finite have been warned of.
    """
    if not tree.report["dropped_triangles"]:
        return ()
    not_finite = arrays.not_finite_faces or (0,) * len(arrays.shapes)
    return tuple(
        f"{shape_name(arrays, number)} cannot be seen: {count - bad} of its "
        f"{shape.face_count} faces have no area; repair the mesh or its to_world"
        for number, (shape, count, bad) in enumerate(
            zip(arrays.shapes, dropped_by_shape(tree, arrays), not_finite, strict=True)
        )
        if count == shape.face_count and bad < count
    )


def report_lines(report: dict[str, Any]) -> list[str]:
    """The figures of `tree_report` and peak_bytes as text.

    Labels are those of Mitsuba where it has them.
    """
    structure = {
        "Builder": report["builder"],
        "Triangles": f"{report['triangles']} ({size(report['triangle_bytes'])})",
        "Dropped triangles": report["dropped_triangles"],
        "Primitive references": (
            f"{report['references']} ({size(report['reference_bytes'])})"
        ),
        "References/triangle": f"{report['references_per_triangle']:.2f}",
        "kd-tree nodes": f"{report['nodes']} ({size(report['node_bytes'])})",
        "kd-tree leaves": f"{report['leaves']}, {report['empty_leaves']} of them empty",
        "kd-tree depth": report["depth"],
        "Total storage": size(report["total_bytes"]),
        "Peak storage while building": size(report["peak_bytes"]),
        "Leaf node histogram": " ".join(
            f"{count}({leaves})" for count, leaves in enumerate(report["leaf_histogram"])
        ),
    }
    if report["wide_bytes"]:
        structure["Form for rays alone"] = size(report["wide_bytes"])
    if report["unbuilt_cells"]:
        structure["Built so far"] = (
            f"{100 * report['built_share']:.1f} %; {report['unbuilt_references']} "
            f"references are left in unbuilt cells, {report['unbuilt_cells']} of them "
            f"({size(report['waiting_bytes'])})"
        )
    quality = {
        "Empty cells by rule 1": report["empty_cell_splits"],
        "Flat cells by rule 2": report["flat_cell_splits"],
        "Small cells by rule 3": report["area_floor_leaves"],
        "Largest leaf node": f"{report['max_leaf_count']} primitives",
        "Avg. prims/nonempty leaf": f"{report['references_per_nonempty_leaf']:.2f}",
        "Expected traversals/query": f"{report['expected_traversals']:.2f}",
        "Expected leaf visits/query": f"{report['expected_leaf_visits']:.2f}",
        "Expected prim. visits/query": f"{report['expected_primitive_visits']:.2f}",
        "Final cost": f"{report['sah_cost']:.2f}",
    }
    phases = {
        name.removeprefix("seconds_"): value
        for name, value in report.items()
        if name.startswith("seconds_") and value > 0
    }
    return [
        "Structural kd-tree statistics:",
        *labelled(structure),
        "Qualitative kd-tree statistics:",
        *labelled(quality),
        "Seconds of building:",
        *labelled({"all": f"{report['seconds']:.3f}"}),
        *labelled({name: f"{value:.3f}" for name, value in phases.items()}),
    ]


def labelled(values: dict[str, Any]) -> list[str]:
    return [f"   {label:<28}: {value}" for label, value in values.items()]


def size(count: float | None) -> str:
    """A number of bytes with a unit."""
    if count is None:
        return "unknown"
    for unit in ("B", "KiB", "MiB"):
        if count < 1024:
            return f"{count:.4g} {unit}"
        count /= 1024
    return f"{count:.4g} GiB"
