"""Large numbers of vertices, faces and nodes."""

from __future__ import annotations

import numpy as np
import pytest
from hard_cases.case import covers
from kd_trees import BUILDERS
from tracing import BRUTE_FORCE, TRAVERSALS, closest

from mlrt_plugin import KdTree
from mlrt_plugin._dispatch import core


@covers(39)
def test_more_vertices_than_floats_count() -> None:
    """Beyond 2^24 a number that goes through single precision on its way loses its last
    bit and means another vertex."""
    count = 2**24 + 4
    vertices = np.zeros((count, 3), np.float32)
    vertices[-3:] = (0, 0, 0), (1, 0, 0), (0, 1, 0)
    # Neighbours of the last three by the last bit would make other triangles, or none.
    faces = np.array([(count - 3, count - 2, count - 1)], np.uint32)
    tree = core.KdTree(vertices, faces)
    assert tree.report["dropped_triangles"] == 0
    rays = np.float32([(0.25, 0.25, 1), (0.7, 0.7, 1)]), np.float32([(0, 0, -1)] * 2)
    for options in (BRUTE_FORCE, *TRAVERSALS.values()):
        assert closest(tree, rays, options).face.tolist() == [0, -1]


@covers(39)
@pytest.mark.parametrize("builder", BUILDERS)
@pytest.mark.parametrize("index", [3, 2**31, 2**32, 2**32 + 1, -1])
def test_indices_are_refused_and_not_wrapped(builder: str, index: int) -> None:
    """2^32 + 1 is 1 in 32 bits, which is a vertex."""
    with pytest.raises(ValueError, match=f"vertex {index}, but there are 3 vertices"):
        KdTree(np.eye(3), np.array([(0, 1, index)], np.int64), **BUILDERS[builder])


@covers(39)
def test_more_nodes_than_a_tree_can_hold() -> None:
    """A number of a child has 30 bits, that of a reference 32: what builders ask before
    they add nodes or references, as so many take more than 12 GB. Files that claim them are
    refused in tests/kdtree/test_restoring.py."""
    check = core.kdtree_selftest.check_tree_size
    check(2**30, 2**32 - 1)
    for nodes in (2**30 + 1, 2**32, 2**32 + 1, 2**62 + 1):
        with pytest.raises(ValueError, match=r"more than 2\^30 nodes"):
            check(nodes, 0)
    for references in (2**32, 2**32 + 1, 2**62):
        with pytest.raises(ValueError, match=r"more than 2\^32 references"):
            check(0, references)


@covers(39)
def test_more_faces_than_a_tree_can_hold() -> None:
    """They are refused before an array of them is copied, which takes 12 GB."""
    faces = np.broadcast_to(np.uint32([0, 1, 2]), (2**30 + 1, 3))
    with pytest.raises(ValueError, match=r"1073741825 faces, more than a kd-tree can hold"):
        KdTree(np.eye(3), faces)
