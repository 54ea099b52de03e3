"""Closed meshes and what is inside of them, by hand and by independent means."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import workloads
from hard_cases.case import grid, joined
from mlrt_compare.bench.closed_meshes import (
    ClosedMesh,
    boundary,
    chosen_meshes,
    closed,
    distances,
    inner_balls,
    is_inside,
    slivers,
    solid_angles,
    sphere,
    usual_meshes,
    winding_number,
)
from mlrt_compare.bench.errors import BenchError
from repository import ROOT

SEED = 3


def winding(mesh: ClosedMesh, *point: float) -> float:
    return winding_number(solid_angles(mesh, np.float32(point)))


def test_boundaries() -> None:
    square = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
    assert sorted(map(tuple, boundary(square))) == [(0, 1), (1, 2), (2, 3), (3, 0)]
    # The diagonal twice in the same direction: neither is met by its reverse.
    turned = np.array([(0, 1, 2), (3, 2, 0)], np.uint32)
    assert sorted(map(tuple, boundary(turned)))[-3:] == [(2, 0), (2, 0), (3, 2)]
    assert len(boundary(workloads.sphere(2)[1])) == 0
    assert len(boundary(np.array([(1, 1, 2), (5, 5, 5)], np.uint32))) == 0


def test_holes_are_closed() -> None:
    vertices, faces = workloads.box()
    opened = np.delete(faces, [0, 5, 6], axis=0)
    with pytest.raises(BenchError, match="the mesh box is not closed"):
        ClosedMesh("box", vertices, opened).checked()
    mesh = closed(
        "box",
        vertices[opened].reshape(-1, 3),
        np.arange(27, dtype=np.uint32).reshape(-1, 3),
    )
    assert len(mesh.vertices) == 8 + 1
    assert abs(winding(mesh, 0, 0, 0)) == pytest.approx(1)


def test_winding_numbers() -> None:
    vertices, faces = workloads.box()
    box = ClosedMesh("box", vertices, faces)
    points = [(0, 0, 0), (0.9, -0.9, 0.99), (1.1, 0, 0), (5, 5, 5)]
    found = [winding(box, *point) for point in points]
    np.testing.assert_allclose(np.abs(found), [1, 1, 0, 0], atol=1e-12)
    twice = ClosedMesh("twice", vertices, np.concatenate([faces, faces]))
    doubled = [winding(twice, *point) for point in points]
    np.testing.assert_allclose(doubled, np.multiply(2, found), atol=1e-12)


@pytest.mark.parametrize(
    ("point", "inside"),
    [
        ((0.5, 0.25, 0), True),
        ((5, 5, 5), False),
        # On a face, an edge, a vertex, and so near to a face that it fills half the view.
        ((1, 0.25, 0), False),
        ((1, 1, 0), False),
        ((1, 1, 1), False),
        ((0.99999, 0.25, 0), False),
    ],
)
def test_points_on_the_mesh_are_not_inside(point: tuple[float, ...], inside: bool) -> None:
    """The box has a grid of faces on each side."""
    sides = []
    for axis in range(3):
        vertices, faces = grid(8, axis)
        for side in (-1, 1):
            moved = vertices.copy()
            moved[:, axis] = side
            # Of the grid across y the normal points backwards.
            outward = (side == 1) != (axis == 1)
            sides.append((moved, faces if outward else faces[:, ::-1]))
    vertices, faces = joined(*sides)
    mesh = closed("box", vertices, faces)
    assert len(mesh.vertices) == 6 * 8 * 8 + 2
    assert is_inside(solid_angles(mesh, np.float32(point))) == inside


@pytest.mark.parametrize("make", [sphere, slivers])
@pytest.mark.parametrize("far", [False, True])
def test_made_meshes(make: object, far: bool) -> None:
    mesh = (sphere(3) if make is sphere else slivers(5, 90)).checked()
    mesh = mesh.moved_far() if far else mesh
    rng = np.random.default_rng(SEED)
    points = inner_balls(mesh, rng, 20).centers
    assert points.shape == (20, 3) and points.dtype == np.float32
    centre = (1e6 if far else 0) * np.ones(3)
    radius = np.linalg.norm(mesh.vertices.astype(np.float64) - centre, axis=1).max()
    assert (np.linalg.norm(points.astype(np.float64) - centre, axis=1) < radius).all()
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    if far:
        assert np.median(lengths) == pytest.approx(1, rel=0.1)
    elif make is slivers:
        assert (lengths.max(axis=1) / lengths.min(axis=1)).max() > 100


@pytest.mark.parametrize("far", [False, True], ids=["at the origin", "far"])
@pytest.mark.parametrize("make", [sphere, slivers], ids=["sphere", "slivers"])
def test_meshes_surround_all_of_an_inner_ball(
    make: Callable[[], ClosedMesh], far: bool
) -> None:
    """By winding numbers of points of the balls, and by distances of points of faces."""
    mesh = make().moved_far() if far else make()
    rng = np.random.default_rng(SEED)
    balls = inner_balls(mesh, rng, 20)
    assert (balls.radii > 0).mean() > 0.9
    for point in balls.points(rng, np.arange(20)):
        assert abs(winding_number(solid_angles(mesh, point))) == pytest.approx(1)
    corners = mesh.vertices[rng.permutation(mesh.faces)[:2000]].astype(np.float64)
    weights = rng.dirichlet((1, 1, 1), 50)
    points = np.einsum("kj,njx->nkx", weights, corners).reshape(-1, 3)
    for center, radius in zip(balls.centers, balls.radii, strict=True):
        assert np.linalg.norm(points - center, axis=1).min() > radius


def test_distances_of_triangles_are_those_of_their_points() -> None:
    rng = np.random.default_rng(SEED)
    corners = rng.normal(size=(200, 3, 3)) + rng.normal(size=(200, 1, 3))
    corners[::10, 2] = corners[::10, 1]
    steps = np.linspace(0, 1, 61)
    u, v = (axis.ravel() for axis in np.meshgrid(steps, steps))
    within = u + v <= 1
    weights = np.stack([1 - u - v, u, v], axis=1)[within]
    points = np.einsum("kj,njx->nkx", weights, corners)
    sampled = np.linalg.norm(points, axis=2).min(axis=1)
    found = distances(corners)
    assert (found <= sampled + 1e-12).all()
    np.testing.assert_allclose(found, sampled, atol=0.05)


def test_meshes_by_name() -> None:
    usual = usual_meshes(ROOT)
    assert [source.name for source in usual][:2] == ["sphere", "sphere at 10^6"]
    assert len(usual) == 8
    assert [s.name for s in chosen_meshes(["slivers"], usual)] == ["slivers"]
    assert [s.name for s in chosen_meshes(["a/cup.xml"], usual)] == ["cup", "cup at 10^6"]
    with pytest.raises(BenchError, match=r"no mesh 'cup': choose from sphere,"):
        chosen_meshes(["cup"], usual)
    (absent, _) = chosen_meshes(["a/cup.xml"], usual)
    with pytest.raises(BenchError, match=r"there is no a/cup\.xml"):
        absent.load()
