"""The wide tree holds what the kd-tree refers to, where rays look for it."""

from __future__ import annotations

import itertools
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from fractions import Fraction
from types import FrameType

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from denormals import denormals_flushed
from kd_trees import each_builder

import mlrt_plugin
from mlrt_plugin._dispatch import core

SEED = 20261128
BLOCK = np.uint32(1 << 31)
NO_PRIMITIVE = np.uint32(0xFFFFFFFF)
SCENES = sorted(workloads.scenes(np.random.default_rng(SEED)))

Box = tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]


class WideTree:
    """Nodes and blocks by the layout in ``cpp/kdtree/wide_tree.h``."""

    def __init__(self, triangles: npt.NDArray[np.float32], **options: object) -> None:
        self.triangles = np.ascontiguousarray(triangles, np.float32)
        found = core.wide_selftest.wide_tree(self.triangles, **options)
        self.root = found["root"]
        nodes = found["nodes"]
        self.faces = nodes[:, :48].view(np.float32).reshape(-1, 2, 3, 8)
        self.children, self.back_to_front = nodes[:, 48:56], nodes[:, 56:]
        blocks = found["blocks"]
        self.coordinates = blocks[:, :72].view(np.float32).reshape(-1, 3, 3, 8)
        self.numbers = blocks[:, 72:]

    def walk(self) -> Iterator[tuple[int, list[Box], int]]:
        """Blocks, the boxes above each of them, and how many nodes."""
        pending: list[tuple[int, list[Box]]] = [(self.root, [])]
        while pending:
            child, boxes = pending.pop()
            if child & int(BLOCK):
                yield child & ~int(BLOCK), boxes, len(boxes)
                continue
            for i in range(8):
                lo, hi = self.faces[child, :, :, i]
                if np.all(lo <= hi):
                    pending.append((int(self.children[child, i]), [*boxes, (lo, hi)]))

    def nodes(self) -> set[int]:
        seen, pending = set(), [self.root]
        while pending:
            child = pending.pop()
            if child & int(BLOCK):
                continue
            seen.add(child)
            there = np.all(self.faces[child, 0] <= self.faces[child, 1], axis=0)
            pending += [int(c) for c in self.children[child, there]]
        return seen


def wide_tree(name: str, builder: str, **options: float) -> WideTree:
    vertices, faces = workloads.scenes(np.random.default_rng(SEED))[name]
    return WideTree(vertices[faces], builder=builder, **options)


@each_builder
@pytest.mark.parametrize("name", SCENES)
def test_each_point_of_a_triangle_is_found(name: str, builder: str) -> None:
    rng = np.random.default_rng(SEED)
    tree = wide_tree(name, builder)
    homes: dict[int, list[list[Box]]] = {}
    for block, boxes, depth in tree.walk():
        assert depth <= core.wide_selftest.max_wide_depth
        for lane, number in enumerate(tree.numbers[block]):
            if number != NO_PRIMITIVE:
                homes.setdefault(int(number), []).append(boxes)
                np.testing.assert_array_equal(
                    tree.coordinates[block, :, :, lane], tree.triangles[number]
                )
    assert homes
    some = rng.permutation(sorted(homes))[:60]
    for number in some:
        corners = [[Fraction(float(x)) for x in v] for v in tree.triangles[number]]
        for weights in [(1, 0, 0), (0, 1, 0), (0, 0, 1), *rng.integers(1, 99, (6, 3))]:
            total = sum(int(w) for w in weights)
            point = [
                sum(int(w) * c[k] for w, c in zip(weights, corners, strict=True)) / total
                for k in range(3)
            ]
            assert any(
                all(
                    Fraction(float(lo[k])) <= point[k] <= Fraction(float(hi[k]))
                    for lo, hi in boxes
                    for k in range(3)
                )
                for boxes in homes[int(number)]
            ), (SEED, name, builder, number, weights)


@each_builder
@pytest.mark.parametrize("name", SCENES)
def test_no_face_that_can_be_hit_is_missing(name: str, builder: str) -> None:
    tree = wide_tree(name, builder)
    held = {int(n) for block, _, _ in tree.walk() for n in tree.numbers[block]}
    expected = {
        i
        for i, triangle in enumerate(tree.triangles)
        if not core.kdtree_selftest.is_degenerate([tuple(map(float, v)) for v in triangle])
    }
    assert held - {int(NO_PRIMITIVE)} == expected


def test_children_come_from_back_to_front() -> None:
    """A child that lies wholly behind another one along an axis, and not in front of it
    along one, comes before it; but for few, where a large leaf was divided and boxes
    overlap."""
    compared = wrong = 0
    for name in SCENES:
        # With small leaves there are more of them.
        tree = wide_tree(name, "exact", intersection_cost=0.375)
        for node in tree.nodes():
            lo, hi = tree.faces[node]
            there = np.flatnonzero(np.all(lo <= hi, axis=0))
            for octant, word in enumerate(tree.back_to_front[node]):
                order = [int(word) >> 4 * i & 15 for i in range(8)]
                assert sorted(order) == list(range(8))
                # Mirrored so that the ray goes towards greater coordinates.
                down = [bool(octant >> k & 1) for k in range(3)]
                begin = np.where(down, -hi.T, lo.T)
                end = np.where(down, -lo.T, hi.T)
                for a, b in itertools.permutations(there, 2):
                    if np.any(begin[a] > end[b]) and not np.any(end[a] <= begin[b]):
                        compared += 1
                        wrong += order.index(a) > order.index(b)
    assert compared > 3000
    assert wrong < compared // 100, (SEED, wrong, compared)


def test_no_triangles_make_a_tree_without_blocks() -> None:
    tree = WideTree(np.zeros((0, 3, 3), np.float32))
    assert list(tree.walk()) == []
    assert tree.nodes() == {tree.root}


def test_many_triangles_in_one_place_are_divided() -> None:
    tree = WideTree(np.tile(np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), (5000, 1, 1)))
    numbers = np.concatenate([tree.numbers[block] for block, _, _ in tree.walk()])
    assert sorted(numbers[numbers != NO_PRIMITIVE]) == list(range(5000))
    assert max(depth for _, _, depth in tree.walk()) <= core.wide_selftest.max_wide_depth


def test_few_copies_are_made_of_the_triangles_of_a_dense_surface() -> None:
    """Cells of the kd-tree cut many of them."""
    vertices, faces = workloads.sphere(5)
    references = mlrt_plugin.KdTree(vertices, faces).report["references"]
    tree = WideTree(vertices[faces])
    numbers = np.concatenate([tree.numbers[block] for block, _, _ in tree.walk()])
    copies = np.count_nonzero(numbers != NO_PRIMITIVE)
    assert len(faces) <= copies < len(faces) + (references - len(faces)) / 2


def bytes_after(rays: int, times: int, **options: object) -> int:
    rng = np.random.default_rng(SEED)
    tree = mlrt_plugin.KdTree(*workloads.sphere(4), **options)
    origins = rng.uniform(-1, 1, (rays, 3)).astype(np.float32)
    for _ in range(times):
        tree.any_hit(origins, -origins[::-1])
    found: int = tree.report["wide_bytes"]
    return found


def test_it_is_made_once_enough_rays_go_alone() -> None:
    few = 500
    references = mlrt_plugin.KdTree(*workloads.sphere(4)).report["references"]
    assert 2 * few < references < 20 * few
    assert bytes_after(few, 2) == 0
    assert bytes_after(few, 50) > 0
    assert bytes_after(50 * few, 1) > 0
    assert bytes_after(50 * few, 1, builder="lazy") == 0


def test_rays_with_a_common_origin_leave_it_alone() -> None:
    tree = mlrt_plugin.KdTree(*workloads.sphere(4))
    directions = np.random.default_rng(SEED).normal(size=(50_000, 3)).astype(np.float32)
    tree.closest_hit(np.zeros_like(directions), directions)
    assert tree.report["wide_bytes"] == 0
    bytes_of_it = tree.widen()
    assert tree.report["wide_bytes"] == bytes_of_it > 0


@each_builder
def test_it_is_not_made_once_it_is_cancelled(builder: str) -> None:
    vertices, faces = workloads.sphere(4)
    triangles = vertices[faces]
    assert core.wide_selftest.is_made(triangles, False, builder=builder)
    assert not core.wide_selftest.is_made(triangles, True, builder=builder)


def widen_with_signal(tree: mlrt_plugin.KdTree) -> None:
    """Makes the wide tree; a signal comes soon after that begins."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.01)
        with pytest.raises(KeyboardInterrupt):
            tree.widen()
            time.sleep(1)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_a_signal_ends_its_making() -> None:
    # Signals are looked for about ten times a second: it must take a while on any machine.
    for subdivisions in (7, 8, 9):
        tree = mlrt_plugin.KdTree(*workloads.sphere(subdivisions), builder="fast")
        widen_with_signal(tree)
        if tree.report["wide_bytes"] == 0:
            break
    assert tree.report["wide_bytes"] == 0
    assert tree.widen() == tree.report["wide_bytes"] > 0


def test_denormal_numbers_count_when_it_is_made() -> None:
    """Whatever mode the thread that asks for it is in."""
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.sphere(3)
    tiny = np.float32(vertices * 2.0**-136)
    origins = np.float32(rng.uniform(-0.3, 0.3, (2000, 3)) * 2.0**-136)
    directions = np.float32(rng.normal(size=(2000, 3)))
    tree = mlrt_plugin.KdTree(tiny, faces)
    with denormals_flushed():
        flushed = np.float32(2.0**-149) * np.ones(1, np.float32)
        tree.widen()
    assert flushed[0] == 0, "denormal numbers were not flushed"
    expected = tree.closest_hit(origins, directions, traversal="brute_force")
    found = tree.closest_hit(origins, directions, traversal="wide")
    assert (expected.primitive >= 0).all()
    np.testing.assert_array_equal(found.primitive, expected.primitive)
    np.testing.assert_array_equal(found.t, expected.t)


def test_rays_are_traced_without_it_if_there_is_no_room() -> None:
    code = (
        "import resource, numpy as np, mlrt_plugin\n"
        "import workloads\n"
        "tree = mlrt_plugin.KdTree(*workloads.sphere(8))\n"
        "origins = np.random.default_rng(1).uniform(-0.5, 0.5, (2000, 3))\n"
        "origins = origins.astype(np.float32)\n"
        "many = np.tile(origins, (800, 1))\n"
        "tree.any_hit(origins[:10], origins[:10])\n"
        "with open('/proc/self/statm') as file:\n"
        "    used = int(file.read().split()[0]) * resource.getpagesize()\n"
        "limit = used + (300 << 20)\n"
        "resource.setrlimit(resource.RLIMIT_AS, (limit, -1))\n"
        "assert len(many) >= 2 * tree.report['references'], tree.report['references']\n"
        "hit = tree.any_hit(many, many[::-1]), tree.any_hit(many, many[::-1])\n"
        "assert tree.report['wide_bytes'] == 0\n"
        "resource.setrlimit(resource.RLIMIT_AS, (-1, -1))\n"
        "print(np.mean(hit))\n"
    )
    child = subprocess.run(
        [sys.executable, "-P", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
    )
    assert child.returncode == 0, child.stderr
    assert child.stdout.strip() == "1.0"
