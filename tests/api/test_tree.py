"""KdTree: arrays in, arrays out. What is hit is compared with an oracle."""

from __future__ import annotations

import threading
import time

import drjit as dr
import mitsuba as mi
import numpy as np
import oracles
import pytest
import workloads

from mlrt_plugin import KdTree

SEED = 20260


def random_rays(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays (N, 3) from around the box [-1, 1]^3 into it, float32."""
    generator = np.random.default_rng(seed)
    origins = generator.normal(size=(count, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    targets = generator.uniform(-1, 1, (count, 3))
    return origins.astype(np.float32), (targets - origins).astype(np.float32)


def test_nearest_hits_are_the_oracles() -> None:
    print(f"seed {SEED}")
    vertices, faces = workloads.sphere(2)
    origins, directions = random_rays(300, SEED)
    t, face = oracles.double_hits(vertices, faces, origins, directions)
    hits = KdTree(vertices, faces).closest_hit(origins, directions)
    np.testing.assert_array_equal(hits.primitive, face)
    np.testing.assert_allclose(hits.t, t, rtol=1e-6)
    assert [a.dtype for a in hits] == [np.float32, np.int32, np.float32, np.float32]
    found = hits.primitive >= 0
    assert 0 < found.sum() < len(found)
    a, b, c = np.moveaxis(vertices[faces[hits.primitive[found]]], 1, 0)
    u, v = hits.u[found, None], hits.v[found, None]
    points = origins[found] + hits.t[found, None] * directions[found]
    np.testing.assert_allclose(a + u * (b - a) + v * (c - a), points, atol=1e-5)


def test_any_hit_agrees_with_closest_hit() -> None:
    vertices, faces = workloads.soup(np.random.default_rng(SEED), 200)
    origins, directions = random_rays(500, SEED + 1)
    tree = KdTree(vertices, faces)
    hits = tree.closest_hit(origins, directions)
    occluded = tree.any_hit(origins, directions)
    assert occluded.dtype == np.bool_
    np.testing.assert_array_equal(occluded, hits.primitive >= 0)
    np.testing.assert_array_equal(np.isinf(hits.t), hits.primitive < 0)


TRIANGLE = ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
DOWN = ([(0.25, 0.25, 2)], [(0, 0, -1)])


@pytest.mark.parametrize(
    ("t_min", "t_max", "hit"),
    [
        (0, np.inf, True),
        (0, 2, True),
        (0, 1.99, False),
        (2, 3, False),
        (1.9, 3, True),
        # What lies behind is never hit, and these bounds leave nothing.
        (-np.inf, 2, True),
        (-np.inf, -1, False),
        (3, 1, False),
        (np.nan, np.inf, False),
        (0, np.nan, False),
        (np.inf, np.inf, False),
    ],
)
def test_interval(t_min: float, t_max: float, hit: bool) -> None:
    tree = KdTree(*TRIANGLE)
    for low, high in ((t_min, t_max), ([t_min], np.array([t_max]))):
        hits = tree.closest_hit(*DOWN, low, high)
        assert (hits.primitive[0] == 0) == hit
        assert hits.t[0] == (2 if hit else np.inf)
        assert tree.any_hit(*DOWN, low, high)[0] == hit


def test_layouts_and_types_make_no_difference() -> None:
    vertices, faces = workloads.box()
    origins, directions = random_rays(64, SEED + 2)
    expected = KdTree(vertices, faces).closest_hit(origins, directions)
    assert (expected.primitive >= 0).any()
    wide = np.zeros((128, 7), np.float32)
    wide[::2, 1:4] = origins
    variants = [
        (origins.astype(np.float64), directions.astype(np.float64)),
        (np.asfortranarray(origins), np.asfortranarray(directions)),
        (wide[::2, 1:4], directions),
        (origins.tolist(), directions.tolist()),
    ]
    other = KdTree(vertices.astype(np.float64)[:, :], np.asfortranarray(faces, np.int64))
    for tree in (KdTree(vertices, faces), other):
        for o, d in variants:
            for a, b in zip(expected, tree.closest_hit(o, d), strict=True):
                np.testing.assert_array_equal(a, b)
    mirrored = KdTree(vertices, faces).closest_hit(origins[::-1], directions[::-1])
    np.testing.assert_array_equal(mirrored.t[::-1], expected.t)


def test_arrays_of_drjit(scalar_variant: None) -> None:
    tensor = mi.TensorXf(np.array(DOWN[0], np.float32))
    hits = KdTree(*TRIANGLE).closest_hit(tensor, DOWN[1])
    assert hits.t.tolist() == [2]
    if not dr.has_backend(dr.JitBackend.LLVM):
        pytest.skip("Dr.Jit has no LLVM here")
    origins = dr.llvm.Array3f([0.25, 0.25], [0.25, 0.25], [2, 3])
    directions = dr.llvm.Array3f([0, 0], [0, 0], [-1, -1])
    hits = KdTree(*TRIANGLE).closest_hit(origins, directions)
    assert hits.t.tolist() == [2, 3]


@pytest.mark.parametrize("count", [0, 1, 3, 17])
def test_any_number_of_rays(count: int) -> None:
    tree = KdTree(*TRIANGLE)
    origins = np.tile(np.array(DOWN[0], np.float32), (count, 1))
    hits = tree.closest_hit(origins, np.tile(np.array(DOWN[1]), (count, 1)))
    assert hits.t.shape == (count,)
    assert (hits.t == 2).all()


def test_tree_without_faces() -> None:
    tree = KdTree(np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    assert tree.closest_hit(*DOWN).primitive.tolist() == [-1]
    assert not tree.any_hit(*DOWN)[0]


def test_rays_that_go_nowhere_miss() -> None:
    nan, inf = np.nan, np.inf
    origins = [(nan, 0, 0), (0.25, 0.25, inf), (0.25, 0.25, 2), (0.25, 0.25, 2), DOWN[0][0]]
    directions = [(0, 0, -1), (0, 0, -1), (0, 0, 0), (0, 0, nan), DOWN[1][0]]
    tree = KdTree(*TRIANGLE)
    assert tree.closest_hit(origins, directions).primitive.tolist() == [-1] * 4 + [0]
    assert tree.any_hit(origins, directions).tolist() == [False] * 4 + [True]
    huge = tree.closest_hit([(1e300, 0, 0)], [(-1, 0, 0)])
    assert huge.primitive.tolist() == [-1]


def test_options_make_no_difference() -> None:
    vertices, faces = workloads.soup(np.random.default_rng(SEED + 3), 300)
    origins, directions = random_rays(400, SEED + 4)
    expected = KdTree(vertices, faces).closest_hit(origins, directions)
    for traversal in ("brute_force", "single", "packet", "interval"):
        for tree in (KdTree(vertices, faces), KdTree(vertices, faces, max_depth=3)):
            hits = tree.closest_hit(origins, directions, traversal=traversal)
            for a, b in zip(expected, hits, strict=True):
                np.testing.assert_array_equal(a, b)


def test_report() -> None:
    report = KdTree(*workloads.box()).report
    assert report["leaves"] == report["inner_nodes"] + 1
    assert report["references"] >= 12


BAD_MESHES = {
    "flat vertices": (np.zeros(9), TRIANGLE[1], r"vertices .*\(9,\)"),
    "wide vertices": (np.zeros((3, 4)), TRIANGLE[1], r"vertices .*\(3, 4\)"),
    "complex vertices": (np.zeros((3, 3), complex), TRIANGLE[1], "vertices .*complex"),
    "flat faces": (TRIANGLE[0], [0, 1, 2], r"faces .*\(3,\)"),
    "quads": (TRIANGLE[0], [(0, 1, 2, 0)], r"faces .*\(1, 4\)"),
    "float faces": (TRIANGLE[0], [(0.0, 1.0, 2.0)], "faces .*float64"),
    "large index": (TRIANGLE[0], [(0, 1, 3)], "vertex 3, but there are 3"),
    "negative index": (TRIANGLE[0], [(0, 1, -1)], "vertex -1"),
    "ragged vertices": ([(0, 0, 0), (1, 0)], TRIANGLE[1], "vertices .*rows of one length"),
    "ragged faces": (TRIANGLE[0], [(0, 1, 2), (0, 1)], "faces .*rows of one length"),
}


@pytest.mark.parametrize("name", BAD_MESHES)
def test_bad_meshes(name: str) -> None:
    vertices, faces, expected = BAD_MESHES[name]
    with pytest.raises(ValueError, match=expected):
        KdTree(vertices, faces)


BAD_RAYS = {
    "one ray": (([0, 0, 2], [0, 0, -1]), r"origins .*\(3,\)"),
    "two columns": ((np.zeros((4, 2)), np.zeros((4, 2))), r"origins .*\(4, 2\)"),
    "different numbers": ((np.zeros((4, 3)), np.ones((5, 3))), r"\(4, 3\) and \(5, 3\)"),
    "text": (([("a", "b", "c")], DOWN[1]), "origins .*<U1"),
    "ragged": (([(0, 0, 2), (0, 0)], DOWN[1]), "origins .*rows of one length"),
    "masked": (
        (np.ma.masked_array(DOWN[0], mask=[(1, 0, 0)]), DOWN[1]),
        "origins .*no masked values",
    ),
    "masked t_max": ((*DOWN, 0, np.ma.masked_array([3.0], mask=[1])), "t_max .*masked"),
    "t_min": ((*DOWN, [0, 0]), r"t_min .*\(1,\), not \(2,\)"),
    "t_max": ((*DOWN, 0, [[1]]), r"t_max .*\(1, 1\)"),
}


@pytest.mark.parametrize("query", ["closest_hit", "any_hit"])
@pytest.mark.parametrize("name", BAD_RAYS)
def test_bad_rays(name: str, query: str) -> None:
    rays, expected = BAD_RAYS[name]
    with pytest.raises(ValueError, match=expected):
        getattr(KdTree(*TRIANGLE), query)(*rays)


def test_unknown_options() -> None:
    with pytest.raises(TypeError, match="'maxdepth'"):
        KdTree(*TRIANGLE, maxdepth=3)
    with pytest.raises(TypeError, match="'packets'"):
        KdTree(*TRIANGLE).any_hit(*DOWN, packets=True)
    with pytest.raises(ValueError, match="traversal"):
        KdTree(*TRIANGLE).any_hit(*DOWN, traversal="fast")


def test_queries_release_the_gil() -> None:
    vertices, faces = workloads.sphere(3)
    tree = KdTree(vertices, faces)
    origins, directions = random_rays(20_000, SEED + 5)
    running = threading.Event()
    ticks = 0

    def count() -> None:
        nonlocal ticks
        while not running.is_set():
            ticks += 1
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    during = 0
    # With the GIL held, the other thread could run once before and once after a query.
    # Beside other work it may not run at all during some.
    for _ in range(20):
        before = ticks
        tree.closest_hit(origins, directions, traversal="brute_force")
        during = max(during, ticks - before)
    running.set()
    thread.join()
    assert during > 2
