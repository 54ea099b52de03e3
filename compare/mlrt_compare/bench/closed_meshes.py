"""Closed meshes and points inside of them, from which no ray can escape.

A mesh is closed if each of its directed edges is there as often as its reverse. A point has
then a winding number, the solid angle of all faces over 4 pi; where that is not zero every
ray from the point meets a face (Jacobson, Kavan and Sorkine-Hornung 2013 give the formula,
after Van Oosterom and Strackee 1983). Faces without area may be left out: what remains is a
closed set that almost all rays meet, and so do their limits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import numpy.typing as npt

from mlrt_plugin.errors import MlrtError
from mlrt_plugin.scene_import import import_scene

from .errors import BenchError

FloatArray = npt.NDArray[np.float32]
DoubleArray = npt.NDArray[np.float64]
FaceArray = npt.NDArray[np.uint32]

FAR = 1e6
"""Along each axis, where meshes are moved to; their edges are then about 1 long."""


@dataclass(frozen=True)
class ClosedMesh:
    """vertices (V, 3) float32, faces (F, 3) uint32."""

    name: str
    vertices: FloatArray
    faces: FaceArray

    def moved_far(self) -> ClosedMesh:
        """Scaled so that the median edge has length 1, and moved by FAR."""
        corners = self.vertices[self.faces].astype(np.float64)
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        scaled = self.vertices.astype(np.float64) / np.median(edges) + FAR
        return ClosedMesh(
            f"{self.name} at 10^6", scaled.astype(np.float32), self.faces
        ).checked()

    def checked(self) -> ClosedMesh:
        """Raises BenchError if the mesh is not closed."""
        if len(boundary(self.faces)):
            raise BenchError(f"the mesh {self.name} is not closed")
        return self


def boundary(faces: FaceArray) -> npt.NDArray[np.int64]:
    """Directed edges (N, 2) that are there more often than their reverse, as often as that.

    faces: (F, 3), over vertices of which no two are at the same place.
    """
    ends = faces.astype(np.int64)
    edges = np.concatenate([ends[:, [0, 1]], ends[:, [1, 2]], ends[:, [2, 0]]])
    low, high = edges.min(axis=1), edges.max(axis=1)
    size = int(edges.max(initial=0)) + 1
    keys, inverse = np.unique(low * size + high, return_inverse=True)
    sign = np.where(edges[:, 0] < edges[:, 1], 1, -1)
    sign[edges[:, 0] == edges[:, 1]] = 0
    excess = np.zeros(len(keys), np.int64)
    np.add.at(excess, inverse.ravel(), sign)
    open_edges = np.repeat(np.arange(len(keys)), np.abs(excess))
    forward = excess[open_edges] > 0
    first, second = keys[open_edges] // size, keys[open_edges] % size
    return np.stack(
        [np.where(forward, first, second), np.where(forward, second, first)], axis=1
    )


def closed(name: str, vertices: FloatArray, faces: FaceArray) -> ClosedMesh:
    """Merges vertices at the same place, leaves out those of no face, and closes holes by a
    cone over their borders.

    The apex is the mean of the borders' vertices. The cone may pass through the rest, which
    does no harm.
    """
    places, inverse = np.unique(vertices[faces].reshape(-1, 3), axis=0, return_inverse=True)
    merged = inverse.reshape(-1, 3).astype(np.uint32)
    border = boundary(merged)
    if len(border):
        apex = places[np.unique(border)].astype(np.float64).mean(axis=0)
        cone = np.insert(border[:, ::-1], 2, len(places), axis=1)
        places = np.concatenate([places, apex[None].astype(np.float32)])
        merged = np.concatenate([merged, cone.astype(np.uint32)])
    return ClosedMesh(name, places, merged).checked()


def solid_angles(mesh: ClosedMesh, point: FloatArray) -> DoubleArray:
    """Of all faces, signed, from a point (3,); 2 pi in size for a face that it is on."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    a, b, c = np.moveaxis(corners - point.astype(np.float64), 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c))
    rest = (
        la * lb * lc
        + np.einsum("ij,ij->i", a, b) * lc
        + np.einsum("ij,ij->i", b, c) * la
        + np.einsum("ij,ij->i", c, a) * lb
    )
    angles: DoubleArray = 2 * np.arctan2(volume, rest)
    return angles


def winding_number(angles: DoubleArray) -> float:
    return float(angles.sum() / (4 * np.pi))


def is_inside(angles: DoubleArray) -> bool:
    """Whether a point is surrounded by the mesh, and so far off all faces that it is not on
    one: from there a ray may meet that face only, at t = 0."""
    winding = winding_number(angles)
    whole = abs(winding - round(winding)) < 1e-3
    return whole and abs(winding) > 0.5 and float(np.abs(angles).max()) < 1.0


@dataclass(frozen=True)
class InnerBalls:
    """Where rays may start: centres (N, 3) and radii (N,), float32.

    Every ray from within a ball meets the mesh, as no face reaches into it. Where a face is
    too near to tell, the radius is 0.
    """

    centers: FloatArray
    radii: FloatArray

    def points(self, rng: np.random.Generator, chosen: npt.NDArray[np.int64]) -> FloatArray:
        """One (N, 3) in each of the chosen balls (N,)."""
        # In the cube that the ball is around.
        reach = self.radii[chosen, None] / np.float32(np.sqrt(3))
        shift = 2 * rng.random((len(chosen), 3), np.float32) - np.float32(1)
        points: FloatArray = self.centers[chosen] + reach * shift
        return points


def inner_balls(mesh: ClosedMesh, rng: np.random.Generator, count: int) -> InnerBalls:
    """Candidates for centres are means of points of the mesh, two for each."""
    found: list[FloatArray] = []
    total = 0
    for _ in range(50):
        if total >= count:
            break
        ends = rng.choice(mesh.vertices, (count, 2)).astype(np.float64)
        share = rng.uniform(0.3, 0.7, (count, 1))
        points = (ends[:, 0] * share + ends[:, 1] * (1 - share)).astype(np.float32)
        inside = points[[is_inside(solid_angles(mesh, point)) for point in points]]
        found.append(inside)
        total += len(inside)
    if total < count:
        raise BenchError(f"there is not enough room inside of the mesh {mesh.name}")
    centers = np.concatenate(found)[:count]
    return InnerBalls(centers, free_radii(mesh, centers))


def free_radii(mesh: ClosedMesh, centers: FloatArray) -> FloatArray:
    """Of balls around the centers (N, 3), (N,): no face is as near, and points that are
    rounded to floats stay within."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    middles = corners.mean(axis=1)
    extents = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    radii = np.zeros(len(centers))
    for i, center in enumerate(centers.astype(np.float64)):
        away = np.linalg.norm(middles - center, axis=1)
        near = away - extents <= away.min()
        distance = distances(corners[near] - center).min()
        radii[i] = 0.9 * distance - 2 * np.spacing(np.float32(np.abs(center).max()))
    return np.maximum(radii, 0).astype(np.float32)


def distances(corners: DoubleArray) -> DoubleArray:
    """Of triangles (N, 3, 3) from the origin, (N,)."""
    edges = np.roll(corners, -1, axis=1) - corners
    squares = np.einsum("nij,nij->ni", edges, edges)
    along = -np.einsum("nij,nij->ni", corners, edges)
    share = np.divide(along, squares, out=np.zeros_like(along), where=squares > 0)
    nearest = corners + np.clip(share, 0, 1)[..., None] * edges
    from_edges = np.linalg.norm(nearest, axis=2).min(axis=1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    # Where the origin lies above or below the triangle, its plane is nearer than its edges.
    sides = np.einsum("nij,nij->ni", np.cross(edges, -corners), normals[:, None])
    lengths = np.linalg.norm(normals, axis=1)
    inside = (sides >= 0).all(axis=1) & (lengths > 0)
    height = np.abs(np.einsum("ni,ni->n", corners[:, 0], normals))
    from_plane = np.divide(height, lengths, out=np.zeros_like(height), where=lengths > 0)
    found: DoubleArray = np.where(inside, from_plane, from_edges)
    return found


def sphere(subdivisions: int = 5) -> ClosedMesh:
    """An octahedron whose faces are split in four, with vertices at radius 1."""
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array(
        [
            (0, 1, 2),
            (1, 3, 2),
            (3, 4, 2),
            (4, 0, 2),
            (1, 0, 5),
            (3, 1, 5),
            (4, 3, 5),
            (0, 4, 5),
        ]
    )
    for _ in range(subdivisions):
        a, b, c = np.moveaxis(corners[faces], 1, 0)
        ab, bc, ca = a + b, b + c, c + a
        split = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        points = np.concatenate([np.stack(part, axis=1) for part in split]).reshape(-1, 3)
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        # Rounded, so that both sides of an edge have the same middle.
        corners, inverse = np.unique(np.round(points, 12), axis=0, return_inverse=True)
        faces = inverse.reshape(-1, 3)
    return closed("sphere", corners.astype(np.float32), faces.astype(np.uint32))


def slivers(rings: int = 12, sectors: int = 700, seed: int = 1) -> ClosedMesh:
    """A ball of needles: meridians at random, so that faces are up to 10^6 times as long as
    wide, and hundreds meet at the poles."""
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0, 2 * np.pi, sectors))
    height = np.sort(rng.uniform(0.05, np.pi - 0.05, rings - 1))
    theta, phi = np.meshgrid(height, turn, indexing="ij")
    radius = rng.uniform(0.97, 1.0, theta.shape)
    ball = radius[..., None] * np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1
    )
    vertices = np.concatenate([ball.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]])
    at = np.arange(ball[..., 0].size).reshape(rings - 1, sectors)
    beside = np.roll(at, -1, axis=1)
    upper, lower = at[:-1], at[1:]
    parts = [
        (upper, lower, beside[1:]),
        (upper, beside[1:], beside[:-1]),
        (np.full(sectors, at.size), at[0], beside[0]),
        (np.full(sectors, at.size + 1), beside[-1], at[-1]),
    ]
    faces = np.concatenate([np.stack([x.ravel() for x in part], 1) for part in parts])
    return closed("slivers", vertices.astype(np.float32), faces.astype(np.uint32))


@dataclass(frozen=True)
class MeshSource:
    """A mesh that is made, or read, when it is needed."""

    name: str
    load: Callable[[], ClosedMesh]


def usual_meshes(source: Path) -> list[MeshSource]:
    """Of a checkout: those that are made, and those of scenes beside it."""
    third_party = source.parent / "shared" / "scenes"
    makers: dict[str, Callable[[], ClosedMesh]] = {
        "sphere": sphere,
        "slivers": slivers,
        "bunny": lambda: scanned("bunny", third_party / "bunny" / "bunny.xml"),
        "dragon": lambda: scanned("dragon", third_party / "dragon" / "dragon.xml"),
    }
    return [
        source
        for name, make in makers.items()
        for source in (MeshSource(name, make), far(MeshSource(name, make)))
    ]


def far(source: MeshSource) -> MeshSource:
    return MeshSource(f"{source.name} at 10^6", lambda: source.load().moved_far())


def chosen_meshes(names: list[str] | None, usual: Sequence[MeshSource]) -> list[MeshSource]:
    """Meshes by name, or by the path of an XML file, which gives its largest shape and the
    same far away; all usual ones for None.

    Raises BenchError for a name that is neither.
    """
    found = []
    by_name = {source.name: source for source in usual}
    for name in by_name if names is None else names:
        path = Path(name)
        if name in by_name:
            found.append(by_name[name])
        elif path.suffix == ".xml":
            source = MeshSource(path.stem, partial(scanned, path.stem, path))
            found += [source, far(source)]
        else:
            raise BenchError(
                f"there is no mesh '{name}': choose from {', '.join(by_name)}, or name an "
                "XML file"
            )
    return found


def scanned(name: str, path: Path) -> ClosedMesh:
    """The shape of a scene that has the most faces, closed.

    Raises BenchError if the scene is not there or cannot be read.
    """
    if not path.is_file():
        raise BenchError(f"there is no {path}: put a scene with the {name} there")
    try:
        arrays = import_scene(path)
    except MlrtError as error:
        raise BenchError(f"the mesh {name} cannot be read: {error}") from error
    largest = max(arrays.shapes, key=lambda shape: shape.face_count)
    first = largest.first_face
    return closed(name, arrays.vertices, arrays.faces[first : first + largest.face_count])
