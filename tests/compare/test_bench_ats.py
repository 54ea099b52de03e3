"""mlrt-bench ats: steps are those of a walk through the same tree in Python, and what is
said of them follows from them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_command import command
from kd_trees import BuiltTree
from mlrt_compare.bench.ats import Steps, baselines, row_of
from mlrt_compare.bench.native import Native
from mlrt_compare.bench.scenes import BenchScene
from numpy.typing import NDArray

Array = NDArray[np.float64]
SIDE = 32


def directions_of(scene: BenchScene, side: int) -> Array:
    """(side, side, 3), through the centres of pixels; z of the camera is 1."""
    view = {key: np.asarray(value, np.float64) for key, value in scene.view.items()}
    at = 1 - 2 * (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(at, at)
    tan = view["tan_half_fov_x"]
    sideways = tan * (x[..., None] * view["axis_x"] + y[..., None] * view["axis_y"])
    return np.asarray(view["axis_z"] + sideways)


def blocks_of(directions: Array) -> Array:
    """Packets of 4 x 4 rays, (N, 16, 3)."""
    side = len(directions)
    blocks = directions.reshape(side // 4, 4, side // 4, 4, 3).swapaxes(1, 2)
    return blocks.reshape(-1, 16, 3)


def nearest(triangles: Array, origin: Array, rays: Array) -> Array:
    """Distances at which rays hit any of the triangles, infinite without (Möller and
    Trumbore 1997)."""
    best = np.full(len(rays), np.inf)
    for a, b, c in triangles:
        normal = np.cross(rays, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / (normal @ (b - a))
            u = (normal @ (origin - a)) * scale
            across = np.cross(origin - a, b - a)
            v, t = (rays @ across) * scale, ((c - a) @ across) * scale
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        best = np.where(hit & (t < best), t, best)
    return best


def steps_from_the_root(tree: BuiltTree, origin: Array, rays: Array) -> int:
    """Nodes that rays visit together, with one interval of parameters for all of them
    (Reshetov et al. 2005, section 3.3), leaves included."""
    corners = np.float64(tree.triangles)
    with np.errstate(divide="ignore", invalid="ignore"):
        low, high = ((np.float64(p) - origin) / rays for p in (tree.lo, tree.hi))
    entry = np.minimum(low, high).max(axis=1)
    leave = np.maximum(low, high).min(axis=1)
    inside = (entry <= leave) & (leave > 0)
    if not inside.any():
        return 0
    begin, end = max(float(entry[inside].min()), 0.0), float(leave[inside].max())
    stack, hits, count = [(0, begin, end)], np.full(len(rays), np.inf), 0
    while stack:
        node, begin, end = stack.pop()
        if begin > hits.max():
            continue
        count += 1
        if tree.is_leaf(node):
            found = nearest(corners[tree.referenced(node)], origin, rays)
            hits = np.minimum(hits, found)
            continue
        axis, lower = int(tree.axis[node]), int(tree.child[node])
        split = float(tree.split[node])
        with np.errstate(divide="ignore"):
            at = (split - origin[axis]) / rays[:, axis]
        is_lower = bool(origin[axis] < split)
        near, far = (lower, lower + 1) if is_lower else (lower + 1, lower)
        # A ray that goes away from the plane never gets beyond it.
        at = np.where(at < 0, np.inf, at)
        first, last = float(at.min()), float(at.max())
        if begin > last:
            stack.append((far, begin, end))
            continue
        if end >= first:
            stack.append((far, max(begin, first), end))
        stack.append((near, begin, min(end, last)))
    return count


@pytest.fixture(scope="module")
def office_steps(native: Native, office: BenchScene) -> dict[str, Any]:
    module = native.module
    mesh = module.Mesh(office.vertices, office.faces)
    tree = module.KdTree(mesh, {"builder": "exact"})
    view = module.View(office.view, SIDE, SIDE)
    return baselines(tree, view, SIDE**2, {}, "office")


def test_steps_from_the_root_are_those_of_a_walk_in_python(
    office: BenchScene, office_steps: dict[str, Any]
) -> None:
    """But for what rounding decides: cells are entered where single precision is unsure."""
    tree = BuiltTree(office.vertices[office.faces], builder="exact")
    origin = np.asarray(office.view["origin"], np.float64)
    directions = directions_of(office, SIDE)
    packets = blocks_of(directions)
    together = sum(steps_from_the_root(tree, origin, rays) for rays in packets)
    alone = sum(
        steps_from_the_root(tree, origin, ray[None]) for ray in directions.reshape(-1, 3)
    )
    expected = 16 * np.array([alone, together]) / SIDE**2
    found = [office_steps[f"{rays}_from_the_root"] for rays in ("single_rays", "packets")]
    assert found == pytest.approx(expected, rel=0.02)


VIEW = {
    **{"origin": (0.0, 0.0, 0.0), "light": (0.0, 0.0, 0.0)},
    **{"axis_x": (1.0, 0.0, 0.0), "axis_y": (0.0, 1.0, 0.0), "axis_z": (0.0, 0.0, 1.0)},
    **{"principal_point_x": 0.0, "principal_point_y": 0.0, "tan_half_fov_x": 0.1},
    **{"near_clip": 0.01, "far_clip": 100.0},
}


def steps_of_two_squares(
    native: Native, *squares: tuple[float, float, float]
) -> dict[str, Any]:
    """Of 64 x 64 rays along z; squares have bounds in x, a z, and leaves of their own."""
    corners = [(x, y, z) for low, high, z in squares for y in (-1, 1) for x in (low, high)]
    faces = [(0, 1, 2), (1, 3, 2), (4, 5, 6), (5, 7, 6)]
    module = native.module
    mesh = module.Mesh(np.array(corners, np.float32), np.array(faces, np.uint32))
    tree = module.KdTree(mesh, {"builder": "exact", "intersection_cost": 50.0})
    view = module.View(VIEW, 64, 64)
    return baselines(tree, view, 64**2, {"minimum_tile": 64}, "two squares")


def test_an_entry_point_at_a_leaf_leaves_one_step_to_packets(native: Native) -> None:
    """All rays meet the first square: by the root, the half x < 1 of it, the cell of the
    square, and the empty one behind, which begins where they hit."""
    found = steps_of_two_squares(native, (-1.0, 1.0, 5.0), (20.0, 22.0, 6.0))
    assert found["packets_from_the_root"] == 4
    assert found["single_rays_from_the_root"] == 16 * 4
    for row in found["with_entry_points"]:
        assert (row["packets"], row["leaves"], row["cells"]) == (1, 1, 0)
        # No search leaves out a node above, and none can visit more than there are.
        assert 3 * 16 / 64**2 <= row["search"] <= 4 * 9 * 16 / 64**2


def test_cells_count_between_entry_points(native: Native) -> None:
    """Squares left and right of the split that is nearest to the root: it is the one entry
    point. Of several there are two, of which a packet has one more cell than the first.

    The left square, from x / z = -0.2 to -0.02, is met by 26 of 64 columns, the right one,
    from 0.05 on, by 16: by 7 and 4 of 16 columns of packets.
    """
    found = steps_of_two_squares(native, (-1.0, -0.1, 5.0), (0.3, 1.0, 6.0))
    one, several = found["with_entry_points"]
    assert one["packets"] == found["packets_from_the_root"] and one["cells"] == 0
    assert several["cells"] == 1
    assert several["packets"] == several["leaves"] == (7 + 4) / 16
    total = several["search"] + (7 + 4) / 16
    assert [each["steps"] for each in several["counted"]] == pytest.approx(
        [total + 1, total + 3]
    )


def test_reasons_are_told_where_goals_are_missed() -> None:
    steps = Steps(search=1.0, cells=2.0, packets=5.0, leaves=2.0)
    row = row_of(20.0, steps, 8, 2.5)
    assert [each["steps"] for each in row["counted"]] == [8.0, 12.0]
    assert [each["reduction"] for each in row["counted"]] == [2.5, 20 / 12]
    met, missed = (each["why_below_goal"] for each in row["counted"])
    assert met is None and missed == (
        "packets visit 5.00 nodes, but 1.00 of searches and 3 * 2.00 of cells exceed the "
        "8.00 steps of the goal"
    )
    high = row_of(20.0, steps, 1, 5.0)["counted"][0]["why_below_goal"]
    assert high.startswith("packets alone visit 5.00 nodes") and "4.00 steps" in high
    assert row_of(20.0, steps, 1, None)["counted"][1]["why_below_goal"] is None


def test_command_writes_figures_and_a_page(
    native: Native, cache: Path, tmp_path: Path
) -> None:
    child = command(
        *("ats", "--scenes", "office,absent.xml", "--resolution", 64, "--cache", cache),
        *("--json", tmp_path / "ats.json", "--markdown", tmp_path / "ats.md"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    office, absent = json.loads((tmp_path / "ats.json").read_text())["scenes"]
    assert "absent.xml" in absent["skipped"]
    assert [block["minimum_tile"] for block in office["blocks"]] == [32, 16, 8]
    for block in office["blocks"]:
        assert block["goal"] == 3.3
        assert [row["entry_points"] for row in block["with_entry_points"]] == [1, 8]
    page = (tmp_path / "ats.md").read_text()
    assert "64 x 64" in page and "absent: skipped" in page
    root = office["blocks"][0]["packets_from_the_root"]
    assert f"| packets from the root | 0.00 | 0.00 | {root:.2f} |" in page
    for title in ("## Beside the paper's ratios", "## office, 843 triangles"):
        assert title in page and title in child.stdout
