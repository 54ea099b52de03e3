"""Vertex normals that are zero or not finite are replaced by the mean of their faces."""

from __future__ import annotations

import numpy as np
import pytest

from mlrt_plugin.mesh_repair import repair_normals

# Two faces meet at vertex 0: one of area 1 facing +z, one of area 1/2 facing +x. Vertex 5
# has only a face without an area.
VERTICES = np.array(
    [[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1], [7, 7, 7]], np.float32
)
FACES = np.array([[0, 1, 2], [0, 3, 4], [5, 5, 5]], np.uint32)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 0])
def test_mean_of_the_faces_by_area(bad: float) -> None:
    normals = np.tile(np.array([0, 1, 0], np.float32), (6, 1))
    normals[0, 1] = normals[5, 1] = bad
    before = normals.copy()
    assert repair_normals(normals, VERTICES, FACES) == 1, "one on a face with an area"
    np.testing.assert_allclose(normals[0], np.array([1, 0, 2]) / np.sqrt(5), rtol=1e-6)
    assert np.linalg.norm(normals[5]) == 1
    assert (normals[1:5] == before[1:5]).all()


def test_finite_normals_stay_as_they_are() -> None:
    normals = np.tile(np.array([0, 1, 0], np.float32), (6, 1))
    before = normals.copy()
    assert repair_normals(normals, VERTICES, FACES) == 0
    assert (normals == before).all()
