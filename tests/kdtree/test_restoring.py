"""Files with a right checksum that no builder wrote: refused, or safe to traverse."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import tree_file_parts
import workloads
from hypothesis import given, settings
from hypothesis import strategies as st
from tree_file_parts import Parts, inner, join, leaf

from mlrt_plugin import KdTree, TreeFileError
from mlrt_plugin._dispatch import core

SEED = 20261123
MAX_DEPTH: int = core.kdtree_selftest.max_tree_depth

RNG = np.random.default_rng(SEED)
VERTICES, FACES = workloads.soup(RNG, 200)
DEGENERATE = 23
VERTICES[FACES[DEGENERATE, 2]] = VERTICES[FACES[DEGENERATE, 1]]
RAYS = RNG.normal(size=(2, 300, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> Parts:
    path = tmp_path_factory.mktemp("trees") / "tree"
    KdTree(VERTICES, FACES).save(path)
    return tree_file_parts.split(path.read_bytes())


def load(parts: Parts, folder: Path) -> KdTree:
    path = folder / "crafted"
    path.write_bytes(join(parts))
    return KdTree.load(path, VERTICES, FACES)


def inner_nodes(parts: Parts) -> list[int]:
    return [int(i) for i in np.flatnonzero(parts.nodes[:, 1] & 3 != 3)]


def full_leaf(parts: Parts) -> int:
    """The leaf with the most references."""
    counts = np.where(parts.nodes[:, 1] & 3 == 3, parts.nodes[:, 1] >> 8, 0)
    return int(counts.argmax())


def with_child(parts: Parts, node: int, child: int) -> Parts:
    payload, info = (int(word) for word in parts.nodes[node])
    return parts.with_node(node, payload, (child << 2) | (info & 3))


def with_split(parts: Parts, node: int, split: float) -> Parts:
    return parts.with_node(node, *inner(0, split, int(parts.nodes[node, 1]) >> 2))


def with_reference(parts: Parts, triangle: int) -> Parts:
    references = parts.references.copy()
    references[len(references) // 2] = triangle
    return parts.but(references=references)


def chain(parts: Parts, depth: int) -> Parts:
    """A tree of `depth` inner nodes, one below the other; the rest of the cells is
    empty."""
    split = float(KdTree(VERTICES, FACES)._tree.bounds[0][0])
    nodes = [leaf(0, 0)] * (2 * depth + 1)
    at = 0
    for level in range(depth):
        nodes[at] = inner(0, split, 2 * level + 1)
        at = 2 * level + 2
    nodes[at] = leaf(0, len(parts.references))
    return parts.but(nodes=np.array(nodes, np.uint32))


COUNT = 0xFFFFFF
CRAFTED: dict[str, tuple[Callable[[Parts], Parts], str]] = {
    "no nodes": (lambda p: p.but(nodes=p.nodes[:0]), "it has no nodes"),
    "child after the last": (
        lambda p: with_child(p, inner_nodes(p)[-1], len(p.nodes)),
        "has a child that does not exist",
    ),
    "upper child after the last": (
        lambda p: with_child(p, 0, len(p.nodes) - 1),
        "node 0 has a child that does not exist",
    ),
    "greatest child": (
        lambda p: with_child(p, 0, (1 << 30) - 1),
        "node 0 has a child that does not exist",
    ),
    "own child": (lambda p: with_child(p, 0, 0), "node 0 is reached twice"),
    "cycle": (lambda p: with_child(p, inner_nodes(p)[3], 0), "node 0 is reached twice"),
    "shared children": (
        lambda p: with_child(p, inner_nodes(p)[-1], int(p.nodes[0, 1]) >> 2),
        "is reached twice",
    ),
    "overlapping children": (
        lambda p: with_child(p, inner_nodes(p)[-1], (int(p.nodes[0, 1]) >> 2) + 1),
        "is reached twice",
    ),
    "too deep": (lambda p: chain(p, MAX_DEPTH + 1), "it is deeper than 64 levels"),
    "far too deep": (lambda p: chain(p, 10_000), "it is deeper than 64 levels"),
    "triangle after the last": (
        lambda p: with_reference(p, len(FACES)),
        f"refers to triangle {len(FACES)} of {len(FACES)}",
    ),
    "greatest triangle": (
        lambda p: with_reference(p, 0xFFFFFFFF),
        f"refers to triangle 4294967295 of {len(FACES)}",
    ),
    "degenerate triangle": (
        lambda p: with_reference(p, DEGENERATE),
        f"refers to triangle {DEGENERATE}, which is degenerate",
    ),
    "reference after the last": (
        lambda p: p.with_node(full_leaf(p), *leaf(len(p.references), 1)),
        "has references that do not exist",
    ),
    "far reference": (
        lambda p: p.with_node(full_leaf(p), *leaf(0xFFFFFFFF, 1)),
        "has references that do not exist",
    ),
    "too many references": (
        lambda p: p.with_node(full_leaf(p), *leaf(0, COUNT)),
        "has references that do not exist",
    ),
    "leaves that overlap": (
        lambda p: p.with_node(full_leaf(p), *leaf(0, len(p.references))),
        "its leaves hold more references than it has",
    ),
    "no references": (
        lambda p: p.but(references=p.references[:0]),
        "has references that do not exist",
    ),
    "plane below its cell": (lambda p: with_split(p, 0, -50.0), "outside its cell"),
    "plane above its cell": (
        lambda p: with_split(p, inner_nodes(p)[-1], 50.0),
        "outside its cell",
    ),
    "plane at infinity": (lambda p: with_split(p, 0, math.inf), "outside its cell"),
    "no plane": (lambda p: with_split(p, 0, math.nan), "outside its cell"),
}


@pytest.mark.parametrize("name", CRAFTED)
def test_unsafe_trees_are_refused(name: str, parts: Parts, tmp_path: Path) -> None:
    craft, expected = CRAFTED[name]
    with pytest.raises(TreeFileError, match="is malformed: ") as caught:
        load(craft(parts), tmp_path)
    assert expected in str(caught.value)


def test_a_tree_over_nothing_has_no_planes(tmp_path: Path, parts: Parts) -> None:
    nothing = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32)
    path = tmp_path / "tree"
    KdTree(*nothing).save(path)
    empty = tree_file_parts.split(path.read_bytes())
    nodes = np.array([inner(0, 0.0, 1), leaf(0, 0), leaf(0, 0)], np.uint32)
    path.write_bytes(join(empty.but(nodes=nodes)))
    with pytest.raises(TreeFileError, match="outside its cell"):
        KdTree.load(path, *nothing)


def test_the_deepest_tree_is_traversed(parts: Parts, tmp_path: Path) -> None:
    tree = load(chain(parts, MAX_DEPTH), tmp_path)
    assert tree.report["depth"] == MAX_DEPTH
    expected = KdTree(VERTICES, FACES).closest_hit(*RAYS)
    assert (expected.primitive >= 0).any()
    for traversal in ("single", "packet", "interval"):
        found = tree.closest_hit(*RAYS, traversal=traversal)
        assert (found.primitive == expected.primitive).all()


@settings(max_examples=300, deadline=None, derandomize=True)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["nodes", "references"]),
            st.integers(0, 2**20),
            st.integers(0, 2**32 - 1) | st.integers(0, 400),
        ),
        min_size=1,
        max_size=3,
    )
)
def test_other_words_are_refused_or_safe(
    parts: Parts,
    tmp_path_factory: pytest.TempPathFactory,
    changes: list[tuple[str, int, int]],
) -> None:
    arrays = {"nodes": parts.nodes.copy(), "references": parts.references.copy()}
    for name, place, value in changes:
        arrays[name].reshape(-1)[place % arrays[name].size] = value
    try:
        tree = load(parts.but(**arrays), tmp_path_factory.getbasetemp())
    except TreeFileError:
        return
    assert tree.report["depth"] <= MAX_DEPTH
    for traversal in ("single", "packet", "interval"):
        tree.closest_hit(*RAYS, traversal=traversal)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_other_bytes_are_refused(
    parts: Parts, tmp_path_factory: pytest.TempPathFactory, seed: int
) -> None:
    rng = random.Random(seed)
    data = bytearray(join(parts))
    for _ in range(rng.randrange(1, 5)):
        kind, place = rng.randrange(3), rng.randrange(len(data))
        if kind == 0:
            data[place] ^= rng.randrange(1, 256)
        elif kind == 1:
            del data[place : place + rng.randrange(1, 9)]
        else:
            data[place:place] = rng.randbytes(rng.randrange(1, 9))
    path = tmp_path_factory.getbasetemp() / "bytes"
    path.write_bytes(data)
    if bytes(data) != join(parts):
        with pytest.raises(TreeFileError):
            KdTree.load(path, VERTICES, FACES)
