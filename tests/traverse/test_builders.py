"""Builders differ in their trees, not in what is hit, and threads make no difference."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import workloads
from kd_trees import BUILDERS, BuiltTree, each_builder
from tracing import BRUTE_FORCE, ENTRY_POINTS, TRAVERSALS, Hits, closest, occluded
from workloads import Rays, Scene

from mlrt_plugin._dispatch import core
from mlrt_plugin.threads import thread_count
from mlrt_plugin.tree_report import tree_report

SEED = 20260214
FIGURES = ("nodes", "leaves", "empty_leaves", "references", "depth", "sah_cost")


def large_scenes() -> dict[str, Scene]:
    """Scenes of 20 thousand triangles and more."""
    rng = np.random.default_rng(SEED)
    ball = workloads.sphere(6)
    crowd = workloads.soup(rng, 20_000, 0.05)
    return {
        "sphere": ball,
        "soup": crowd,
        "both": (
            np.concatenate([ball[0] / 2, crowd[0]]),
            np.concatenate([ball[1], crowd[1] + np.uint32(len(ball[0]))]),
        ),
    }


def tree_of(builder: str, scene: Scene, **options: Any) -> Any:
    return core.KdTree(*scene, **BUILDERS[builder], **options)


@each_builder
@pytest.mark.parametrize("name", sorted(workloads.scenes(np.random.default_rng(SEED))))
def test_same_hits_as_brute_force(builder: str, name: str) -> None:
    rng = np.random.default_rng(SEED)
    scene = workloads.scenes(rng)[name]
    rays = workloads.all_rays(rng, scene, 60)
    expected = closest(tree_of("exact", scene), rays, BRUTE_FORCE)
    assert (expected.face >= 0).any()
    for way in (*TRAVERSALS.values(), *ENTRY_POINTS.values()):
        # A new tree each time: growing one is a part of what is tested.
        tree = tree_of(builder, scene)
        closest(tree, rays, way).assert_same(expected)
        closest(tree, rays, way).assert_same(expected)
        tree = tree_of(builder, scene)
        np.testing.assert_array_equal(occluded(tree, rays, way), expected.face >= 0)


@each_builder
@pytest.mark.parametrize("name", large_scenes())
def test_same_hits_in_large_scenes(builder: str, name: str) -> None:
    scene = large_scenes()[name]
    rays = workloads.all_rays(np.random.default_rng(SEED), scene, 25)
    tree = tree_of(builder, scene)
    expected = closest(tree, rays, BRUTE_FORCE)
    assert (expected.face >= 0).mean() > 0.2
    for way in ("single", "packet"):
        closest(tree_of(builder, scene), rays, TRAVERSALS[way]).assert_same(expected)
    for way in ("default tiles", "small tiles"):
        closest(tree_of(builder, scene), rays, ENTRY_POINTS[way]).assert_same(expected)
    many = workloads.camera(scene, 0, 128)
    exact = closest(tree_of("exact", scene), many, TRAVERSALS["packet"])
    closest(tree, many, ENTRY_POINTS["default tiles"]).assert_same(exact)


def contents(tree: BuiltTree) -> list[tuple[Any, ...]]:
    """All nodes in the order of a walk, whatever their numbers."""
    nodes: list[tuple[Any, ...]] = []
    for visit in tree.walk():
        if tree.is_leaf(visit.node):
            nodes.append(tuple(tree.referenced(visit.node)))
        else:
            split = tree.split[visit.node].tobytes()
            nodes.append(("inner", int(tree.axis[visit.node]), split))
    return nodes


@each_builder
@pytest.mark.parametrize("name", ["soup", "both"])
def test_same_tree_by_any_number_of_threads(builder: str, name: str) -> None:
    vertices, faces = large_scenes()[name]

    def built(threads: int) -> BuiltTree:
        with thread_count(threads):
            return BuiltTree(vertices[faces], **BUILDERS[builder])

    one = built(1)
    for threads in (2, 3, 8):
        several = built(threads)
        if builder.startswith("lazy"):
            # Nodes are numbered in the order in which they come about.
            assert contents(one) == contents(several)
        else:
            for a, b in zip(one.arrays, several.arrays, strict=True):
                assert a.tobytes() == b.tobytes()
            assert one.references.tobytes() == several.references.tobytes()
        for figure, value in one.report.items():
            if not figure.startswith("seconds"):
                assert several.report[figure] == value, figure


@pytest.mark.parametrize("name", large_scenes())
def test_lazy_trees_end_up_as_fast_ones(name: str) -> None:
    vertices, faces = large_scenes()[name]
    lazy, fast = (
        contents(BuiltTree(vertices[faces], **BUILDERS[b], intersection_cost=0.375))
        for b in ("lazy", "fast")
    )
    assert len(fast) > 10_000
    assert lazy == fast


class Callers:
    """Several threads that query one tree at the same moment."""

    def __init__(self, tree: Any, queries: list[tuple[Rays, dict[str, Any]]]) -> None:
        self.tree = tree
        self.queries = queries
        self.hits: list[Hits | None] = [None] * len(queries)
        self.barrier = threading.Barrier(len(queries))

    def call(self, number: int) -> None:
        rays, way = self.queries[number]
        self.barrier.wait()
        self.hits[number] = closest(self.tree, rays, way)

    def run(self) -> list[Hits | None]:
        threads = [
            threading.Thread(target=self.call, args=(i,)) for i in range(len(self.queries))
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        return self.hits


def test_lazy_trees_are_finished_while_others_ask() -> None:
    """What is finished has the figures of the fast builder's tree."""
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 2000, 0.1)
    rays = workloads.all_rays(rng, scene, 200)
    fast = tree_of("fast", scene)
    expected = closest(fast, rays, TRAVERSALS["packet"])
    figures = {name: tree_report(fast)[name] for name in FIGURES}
    with thread_count(2):
        for _ in range(30):
            tree = tree_of("lazy", scene)
            callers = Callers(tree, [(rays, TRAVERSALS["single"])] * 3)
            asking = threading.Thread(target=callers.run)
            asking.start()
            core.finish_tree(tree)
            report = tree_report(tree)
            asking.join()
            assert {name: report[name] for name in FIGURES} == pytest.approx(figures)
            for hits in callers.hits:
                assert hits is not None
                hits.assert_same(expected)


def widen(tree: Any, sizes: list[int]) -> None:
    sizes.append(tree.widen())


@each_builder
@pytest.mark.parametrize("pool", [1, 2, 8])
def test_one_wide_tree_while_many_threads_ask(builder: str, pool: int) -> None:
    """For it, for hits by it, and by rays enough to make it."""
    rng = np.random.default_rng(SEED)
    scene = workloads.soup(rng, 1000, 0.1)
    rays = workloads.all_rays(rng, scene, 600)
    expected = closest(tree_of("exact", scene), rays, TRAVERSALS["packet"])
    ways = [TRAVERSALS[name] for name in ("wide", "wide", "adaptive")]
    with thread_count(pool):
        for _ in range(8):
            tree = tree_of(builder, scene)
            sizes: list[int] = []
            asking = [threading.Thread(target=widen, args=(tree, sizes)) for _ in range(2)]
            for thread in asking:
                thread.start()
            found = Callers(tree, [(rays, way) for way in ways]).run()
            for thread in asking:
                thread.join()
            assert sizes == [tree.widen()] * 2
            for hits in found:
                assert hits is not None, f"seed {SEED}: a thread failed"
                hits.assert_same(expected)


def part(rays: Rays, order: npt.NDArray[np.int64]) -> Rays:
    return np.ascontiguousarray(rays[0][order]), np.ascontiguousarray(rays[1][order])


@each_builder
@pytest.mark.parametrize("pool", [1, 2, 8])
@pytest.mark.parametrize("callers", [1, 4])
def test_same_hits_while_many_threads_ask(builder: str, pool: int, callers: int) -> None:
    """Each asks for all rays in an order of its own, so that they meet in every part."""
    rng = np.random.default_rng(SEED)
    scenes = [workloads.soup(rng, 400, 0.2), workloads.sphere(3), workloads.stairs()]
    ways = [
        *TRAVERSALS.values(),
        ENTRY_POINTS["default tiles"],
        ENTRY_POINTS["small tiles"],
    ]
    for scene in scenes:
        rays = workloads.all_rays(rng, scene, 300)
        expected = closest(tree_of("exact", scene), rays, TRAVERSALS["packet"])
        with thread_count(pool):
            for repetition in range(12):
                orders = [rng.permutation(len(rays[0])) for _ in range(callers)]
                queries = [
                    (part(rays, order), ways[(repetition + i) % len(ways)])
                    for i, order in enumerate(orders)
                ]
                found = Callers(tree_of(builder, scene), queries).run()
                for order, hits in zip(orders, found, strict=True):
                    assert hits is not None, f"seed {SEED}: a thread failed"
                    hits.assert_same(
                        Hits(
                            expected.t[order],
                            expected.face[order],
                            expected.u[order],
                            expected.v[order],
                        )
                    )
