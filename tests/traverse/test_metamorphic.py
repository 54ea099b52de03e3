"""What is done to scene and rays is found again in the hits, however they are traced."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import oracles
from edge_distance import edge_distance
from hard_cases.running import WAYS
from hypothesis import given, settings
from hypothesis import strategies as st
from kd_trees import BUILDERS
from small_scenes import Traced, traced
from tracing import BRUTE_FORCE, Hits, build, closest, occluded

from mlrt_plugin._dispatch import core
from mlrt_plugin.threads import thread_count

ways = st.sampled_from(sorted(WAYS))
builders = st.sampled_from(sorted(BUILDERS))
each = settings(max_examples=100, deadline=None)


def hits(case: Traced, way: str, builder: str, **ends: Any) -> Hits:
    return closest(
        build(core, case.scene, **BUILDERS[builder]), case.rays, WAYS[way], **ends
    )


def reference(case: Traced) -> Hits:
    return closest(build(core, case.scene), case.rays, BRUTE_FORCE)


@each
@given(traced(), ways, builders, st.integers(-40, 40), st.integers(-40, 40))
def test_scaling_by_powers_of_two(
    case: Traced, way: str, builder: str, power: int, length: int
) -> None:
    """The scene by 2^power and directions by 2^length: distances by their quotient."""
    size, stretch = np.float32(2.0**power), np.float32(2.0**length)
    scaled = replace(
        case,
        vertices=case.vertices * size,
        origins=case.origins * size,
        directions=case.directions * stretch,
    )
    plain, found = reference(case), hits(scaled, way, builder)
    np.testing.assert_array_equal(found.face, plain.face)
    np.testing.assert_array_equal(found.t, plain.t * np.float32(2.0 ** (power - length)))


@each
@given(
    traced(),
    ways,
    builders,
    st.permutations([0, 1, 2]),
    st.tuples(*[st.sampled_from([-1.0, 1.0])] * 3),
)
def test_exchanging_axes_and_mirroring(
    case: Traced, way: str, builder: str, axes: list[int], signs: tuple[float, ...]
) -> None:
    def turned(vectors: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(vectors[:, axes] * np.float32(signs))

    other = replace(
        case,
        vertices=turned(case.vertices),
        origins=turned(case.origins),
        directions=turned(case.directions),
    )
    plain, found = reference(case), hits(other, way, builder)
    np.testing.assert_array_equal(found.face, plain.face)
    np.testing.assert_array_equal(found.t, plain.t)


def rotation(quaternion: tuple[float, ...]) -> np.ndarray:
    w, x, y, z = np.array(quaternion) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


UNIT_ROUNDOFF = 2.0**-24


@each
@given(
    traced(),
    ways,
    builders,
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1),
    st.tuples(*[st.floats(-8, 8)] * 3),
)
def test_rigid_motions(
    case: Traced,
    way: str,
    builder: str,
    quaternion: tuple[float, ...],
    shift: tuple[float, ...],
) -> None:
    """Motions are rounded to single precision: each point moves by at most sqrt(3) u R with
    R the greatest coordinate, and the point of the ray at distance D by sqrt(3) u (R + D).

    A ray whose line passes all edges by more than both of that hits the same triangles. A
    hit point moves across its triangle's plane by as much, as it is a convex combination of
    the corners, so along the ray by that over the cosine of the incidence; twice that
    covers what is of second order. Where triangles, or the origin, are closer to one
    another than that, either may come first.
    """
    matrix = rotation(quaternion)

    def moved(points: np.ndarray, offset: Any) -> np.ndarray:
        return (points.astype(np.float64) @ matrix.T + offset).astype(np.float32)

    other = replace(
        case,
        vertices=moved(case.vertices, shift),
        origins=moved(case.origins, shift),
        directions=moved(case.directions, 0),
    )
    found = hits(other, way, builder)
    soup = oracles.Soup(*case.scene)
    greatest = max(np.abs(a).max() for a in (case.vertices, case.origins, other.vertices,
                                             other.origins))  # fmt: skip
    # All vertices are within 2 sqrt(3) R of all origins.
    movement = math.sqrt(3) * UNIT_ROUNDOFF * (2 + 2 * math.sqrt(3)) * float(greatest)
    for i, crossings in enumerate(soup.crossings(*case.rays)):
        direction = case.directions[i].astype(np.float64)
        if not direction.any():
            assert found.face[i] == -1
            continue
        if edge_distance(soup, case.origins[i], case.directions[i]) <= movement:
            continue
        ranges = {}
        for crossing in crossings:
            a, b, c = case.vertices[case.faces[crossing.face]].astype(np.float64)
            normal = np.cross(b - a, c - a)
            across = abs(normal @ direction) / np.linalg.norm(normal)
            t = float(crossing.exact)
            slack = 2 * movement / across + 2 * UNIT_ROUNDOFF * abs(t)
            ranges[crossing.face] = t - slack, t + slack
        ahead = {face: span for face, span in ranges.items() if span[1] > 0}
        certain = [span[1] for span in ahead.values() if span[0] > 0]
        last = min(certain, default=math.inf)
        first = {face for face, span in ahead.items() if span[0] <= last}
        if found.face[i] == -1:
            assert not certain, (i, ranges)
        else:
            assert found.face[i] in first, (i, ranges)
            lo, hi = ahead[found.face[i]]
            assert lo <= found.t[i] <= hi, (i, ranges)


@each
@given(traced(lattice=True), ways, builders)
def test_reversed_segments_are_as_occluded(case: Traced, way: str, builder: str) -> None:
    """Both ends excluded. On the lattice parameters are fractions of denominators below
    10^5, so that none is rounded to 0 or to 1."""
    tree = build(core, case.scene, **BUILDERS[builder])
    ends = (
        np.nextafter(np.float32(0), np.float32(1)),
        np.nextafter(np.float32(1), np.float32(0)),
    )
    there = occluded(tree, case.rays, WAYS[way], *ends)
    back = case.origins + case.directions, -case.directions
    np.testing.assert_array_equal(occluded(tree, back, WAYS[way], *ends), there)


@each
@given(traced(), ways, builders, st.randoms(use_true_random=False))
def test_order_of_triangles_and_corners(
    case: Traced, way: str, builder: str, random: Any
) -> None:
    """Of equally near ones the first of the list counts, whatever the list."""
    order = list(range(len(case.faces)))
    random.shuffle(order)
    turned = [list(case.faces[i]) for i in order]
    for corners in turned:
        random.shuffle(corners)
    found = hits(replace(case, faces=np.array(turned, np.uint32)), way, builder)
    places = {face: place for place, face in enumerate(order)}
    for i, hit in enumerate(oracles.Soup(*case.scene).hits(*case.rays)):
        if hit is None:
            assert found.face[i] == -1 and found.t[i] == np.inf
        else:
            assert found.face[i] == min(places[face] for face in hit.faces)
            assert found.t[i] == hit.t


@each
@given(traced(), ways, builders, st.randoms(use_true_random=False))
def test_two_meshes_for_one(case: Traced, way: str, builder: str, random: Any) -> None:
    """The nearer hit of two parts of a scene is that of the whole."""
    own = np.array([random.random() < 0.5 for _ in case.faces])
    plain = reference(case)
    t = np.full(len(case.origins), np.inf, np.float32)
    face = np.full(len(case.origins), -1)
    for part in (np.flatnonzero(own), np.flatnonzero(~own)):
        found = hits(replace(case, faces=case.faces[part]), way, builder)
        number = np.append(part, -1)[found.face]
        nearer = (found.t < t) | ((found.t == t) & (number < face))
        t, face = np.where(nearer, found.t, t), np.where(nearer, number, face)
    np.testing.assert_array_equal(t, plain.t)
    np.testing.assert_array_equal(face, plain.face)


@each
@given(traced(), ways, builders)
def test_triangles_that_share_no_vertices(case: Traced, way: str, builder: str) -> None:
    apart = replace(
        case,
        vertices=case.vertices[case.faces].reshape(-1, 3),
        faces=np.arange(3 * len(case.faces), dtype=np.uint32).reshape(-1, 3),
    )
    hits(apart, way, builder).assert_same(reference(case))


@each
@given(traced(lattice=True), ways, builders)
def test_triangles_split_in_four(case: Traced, way: str, builder: str) -> None:
    """Midpoints of edges are exact on the lattice: the parts make up the triangle, and lie
    in its plane."""
    a, b, c = np.moveaxis(case.vertices[case.faces], 1, 0)
    half = np.float32(0.5)
    ab, bc, ca = (a + b) * half, (b + c) * half, (c + a) * half
    parts = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    vertices = parts.reshape(-1, 3)
    fine = replace(
        case,
        vertices=vertices,
        faces=np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3),
    )
    plain, found = reference(case), hits(fine, way, builder)
    np.testing.assert_array_equal(found.t, plain.t)
    np.testing.assert_array_equal(np.where(found.face < 0, -1, found.face // 4), plain.face)


@each
@given(traced(), ways, builders, st.integers(0, 70), st.integers(0, 20))
def test_offsets_in_a_tile(
    case: Traced, way: str, builder: str, before: int, behind: int
) -> None:
    """Other rays in front, from the same origin or not, and behind."""
    plain = hits(case, way, builder)
    for others in (case.origins[0], np.float32([9, 9, 9])):
        count = before + behind
        origins = np.tile(others, (count, 1)).astype(np.float32)
        directions = np.tile(np.float32([1, 2, -3]), (count, 1))
        among = replace(
            case,
            origins=np.concatenate([origins[:before], case.origins, origins[before:]]),
            directions=np.concatenate(
                [directions[:before], case.directions, directions[before:]]
            ),
        )
        found = hits(among, way, builder)
        part = slice(before, before + len(case.origins))
        Hits(found.t[part], found.face[part], found.u[part], found.v[part]).assert_same(
            plain
        )


@each
@given(traced(), ways, builders, st.integers(1, 4), st.integers(1, 60))
def test_numbers_of_threads(
    case: Traced, way: str, builder: str, threads: int, copies: int
) -> None:
    """Rays are repeated till there are several pieces of work."""
    many = replace(
        case,
        origins=np.tile(case.origins, (copies, 1)),
        directions=np.tile(case.directions, (copies, 1)),
    )
    plain = reference(case)
    with thread_count(threads):
        found = hits(many, way, builder)
    for name in ("face", "t", "u", "v"):
        np.testing.assert_array_equal(
            getattr(found, name), np.tile(getattr(plain, name), copies)
        )


def test_every_way_is_drawn() -> None:
    """The ways above are those of the paper and of this tracer, by name."""
    traversals = {options["traversal"] for options in WAYS.values()}
    assert traversals == {
        "brute_force",
        "single",
        "wide",
        "packet",
        "interval",
        "beam_leaf",
        "adaptive",
    }
    for traversal, entry_points in itertools.product(
        traversals - {"brute_force"}, (True, False)
    ):
        assert any(
            (options["traversal"], options["entry_points"]) == (traversal, entry_points)
            for options in WAYS.values()
        ), (traversal, entry_points)
