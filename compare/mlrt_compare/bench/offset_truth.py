"""Which pixels see a light, in double precision and without any offset."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin._dispatch import core
from mlrt_plugin.render import PreparedScene

Doubles = npt.NDArray[np.float64]
Bools = npt.NDArray[np.bool_]

BEGIN = 1e-10
"""The share of a segment's length, at both ends, in which nothing counts: rounding in
double precision is far below it, the details of the scene far above."""
UNITS = 4
"""Of single precision's last place: what is decided by less is not decided."""
ROUNDING = 2.0**-24
GRAZING = 1e-6
"""Cosines below that may have either sign in single precision."""
CHUNK = 1024


@dataclass(frozen=True)
class Segments:
    """From hits to the light.

    start, target: (N, 3). face: (N,) what was hit. pixel: (N,) numbers of pixels.
    unlit: (N,) whether the light is behind the surface or the surface behind the light.
    grazing: (N,) whether that is not decided in single precision.
    """

    start: Doubles
    target: Doubles
    face: npt.NDArray[np.int64]
    pixel: npt.NDArray[np.int64]
    unlit: Bools
    grazing: Bools


@dataclass(frozen=True)
class PixelSamples:
    """The samples of an image with one a pixel and the seed 0, row by row.

    origin: (3,) float32. directions: (N, 3) float32, of the camera rays. light: (N, 2),
    the random numbers that choose a point of the light.
    """

    origin: npt.NDArray[np.float32]
    directions: npt.NDArray[np.float32]
    light: Doubles


def pixel_samples(prepared: PreparedScene) -> PixelSamples:
    arrays = prepared.arrays
    camera, film = dataclasses.asdict(arrays.camera), dataclasses.asdict(arrays.film)
    width, count = arrays.film.width, arrays.film.width * arrays.film.height
    directions, light = np.empty((count, 3), np.float32), np.empty((count, 2))
    for pixel in range(count):
        stream = core.render_selftest.sampler_stream(0, count, 1, pixel, 0, 4)
        row, column = divmod(pixel, width)
        x, y = np.float32(column) + np.float32(stream[0]), np.float32(row) + stream[1]
        directions[pixel] = core.render_selftest.camera_direction(camera, film, x, y)
        light[pixel] = stream[2:]
    return PixelSamples(np.array(arrays.camera.origin, np.float32), directions, light)


def traced_segments(prepared: PreparedScene, primitive: npt.NDArray[np.int32]) -> Segments:
    """The segments of the image of `pixel_samples`.

    primitive: (H, W), the face that each pixel's sample hit, which is decided exactly.
    """
    arrays = prepared.arrays
    selftest = core.render_selftest
    # What glows comes last and is not looked at.
    count = arrays.shapes[0].face_count
    hits = [i for i, face in enumerate(primitive.ravel()) if 0 <= face < count]
    samples = pixel_samples(prepared)
    origin, directions = samples.origin, samples.directions[hits].astype(np.float64)
    targets = np.empty((len(hits), 3))
    for i, pixel in enumerate(hits):
        direction, face = samples.directions[pixel], int(primitive.flat[pixel])
        point = selftest.hit_surface(prepared.handle, origin, direction, face)["p"]
        sample = selftest.sample_emitter(prepared.handle, point, *samples.light[pixel])
        targets[i] = sample["target"]
    faces = primitive.ravel()[hits].astype(np.int64)
    corners = triangles_of(arrays)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    start = crossings(origin.astype(np.float64), directions, corners, normals)
    emitter = arrays.emitters[0]
    if emitter.type == "directional":
        # The sample is a point of the ray only; what counts is the direction.
        reach = 100 * float(np.ptp(arrays.vertices, axis=0).max())
        targets = start - reach * np.array(emitter.direction)
    way = targets - start
    way_length = np.linalg.norm(way, axis=1)
    from_eye = dot(normals, -directions) / np.linalg.norm(directions, axis=1)
    to_light = dot(normals, way) / way_length
    leaving = np.ones(len(start))
    if emitter.type == "area":
        panel = np.cross(np.array(emitter.edge_u), np.array(emitter.edge_v))
        leaving = -(way @ panel) / way_length / np.linalg.norm(panel)
    cosines = np.stack([from_eye, to_light, leaving])
    return Segments(
        start,
        targets,
        faces,
        np.array(hits, np.int64),
        (from_eye * to_light <= 0) | (leaving <= 0),
        (np.abs(cosines) < GRAZING).any(axis=0),
    )


def dot(a: Doubles, b: Doubles) -> Doubles:
    product: Doubles = np.einsum("ij,ij->i", a, b)
    return product


def crossings(origin: Doubles, d: Doubles, corners: Doubles, normals: Doubles) -> Doubles:
    """Where rays cross the planes of triangles: interpolated, so that the point is of the
    plane however far the ray has come."""
    a, b, c = (corners[:, k] - origin for k in range(3))
    weights = np.abs([dot(d, np.cross(p, q)) for p, q in ((b, c), (c, a), (a, b))])
    weights /= weights.sum(axis=0)
    points: Doubles = np.einsum("kn,nkj->nj", weights, corners)
    return points


def triangles_of(arrays: Any) -> Doubles:
    triangles: Doubles = arrays.vertices[arrays.faces].astype(np.float64)
    return triangles


def blocked(
    triangles: Doubles, start: Doubles, target: Doubles, left_out: npt.NDArray[np.int64]
) -> Bools:
    """Whether anything but one face each lies between both ends.

    A line passes a triangle where it passes all three edges on the same side, which the
    products of Plücker coordinates tell (Shoemake 1998, "Plücker coordinate tutorial").
    """
    center = triangles.mean(axis=(0, 1))
    corners = triangles - center
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    offset = (a * normal).sum(axis=1)
    edges = [(np.cross(p, q), q - p) for p, q in ((a, b), (b, c), (c, a))]
    result = np.zeros(len(start), bool)
    numbers = np.arange(len(triangles))
    for first in range(0, len(start), CHUNK):
        part = slice(first, first + CHUNK)
        s, d = start[part] - center, target[part] - start[part]
        moment = np.cross(s, d)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = (offset - s @ normal.T) / (d @ normal.T)
        hit = (t > BEGIN) & (t < 1 - BEGIN) & (numbers != left_out[part][:, None])
        sides = [d @ m.T + moment @ e.T for m, e in edges]
        hit &= ((sides[0] >= 0) & (sides[1] >= 0) & (sides[2] >= 0)) | (
            (sides[0] <= 0) & (sides[1] <= 0) & (sides[2] <= 0)
        )
        result[part] = hit.any(axis=1)
    return result


@dataclass(frozen=True)
class Judgement:
    """Of an image: pixels that should see the light, and those that are wrong.

    acne: lit ones that are dark; leaks: dark ones that are lit; undecided: wrong ones that
    four units in the last place of either end, or a grazing angle, decide.
    """

    lit: int
    dark: int
    acne: int
    leaks: int
    undecided: int
    marks: npt.NDArray[np.int8]
    """(H, W): 1 acne, 2 leak, 3 undecided, else 0."""


def judge(
    prepared: PreparedScene, segments: Segments, expected: Bools, image: Any
) -> Judgement:
    """expected: (N,) which of the segments see the light, of `visible`."""
    height, width = image.shape[:2]
    lit = image.reshape(-1, 3).max(axis=1)[segments.pixel] > 0
    wrong = np.flatnonzero(lit != expected)
    unclear = segments.grazing[wrong] | changes(prepared, segments, expected, wrong)
    marks = np.zeros(height * width, np.int8)
    marks[segments.pixel[wrong]] = np.where(unclear, 3, np.where(lit[wrong], 2, 1))
    return Judgement(
        int(expected.sum()),
        int((~expected).sum()),
        int((marks == 1).sum()),
        int((marks == 2).sum()),
        int((marks == 3).sum()),
        marks.reshape(height, width),
    )


def occluders(arrays: Any) -> Doubles:
    """All faces that do not glow: a light does not stand in its own way."""
    count = arrays.shapes[0].face_count
    return triangles_of(arrays)[:count]


def visible(prepared: PreparedScene, segments: Segments) -> Bools:
    triangles = occluders(prepared.arrays)
    free = ~blocked(triangles, segments.start, segments.target, segments.face)
    return free & ~segments.unlit


def changes(
    prepared: PreparedScene,
    segments: Segments,
    expected: Bools,
    chosen: npt.NDArray[np.int64],
) -> Bools:
    """Whether rounding either end in some way decides what the segments see."""
    triangles = occluders(prepared.arrays)
    start, target = segments.start[chosen], segments.target[chosen]
    face, known = segments.face[chosen], expected[chosen]
    result = np.zeros(len(chosen), bool)
    if len(chosen) == 0:
        return result
    size = np.abs(start).max(axis=1, keepdims=True)
    reach = np.linalg.norm(target - start, axis=1, keepdims=True)
    unit = UNITS * ROUNDING
    corners = triangles_of(prepared.arrays)[face]
    edge = corners[:, 1] - corners[:, 0]
    normal = np.cross(edge, corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.sign(dot(normal, target - start))[:, None]
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    other = np.cross(normal, edge)
    for angle in np.arange(8) * np.pi / 4:
        tangent = np.cos(angle) * edge + np.sin(angle) * other
        for lift in (0.0, 1.0):
            moved = start + unit * size * (tangent + lift * normal)
            free = ~blocked(triangles, moved, target, face)
            result |= free != known
    for axis in np.concatenate([np.eye(3), -np.eye(3)]):
        moved = target + unit * (np.abs(target).max(axis=1, keepdims=True) + reach) * axis
        free = ~blocked(triangles, start, moved, face)
        result |= free != known
    return result & ~segments.unlit[chosen]
