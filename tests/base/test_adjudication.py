"""Distances to edges and judgements, against cases done by hand."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import oracles
import pytest
import workloads
from adjudication import Verdict, adjudicate
from edge_distance import edge_distance

SEED = 20261128
# Two triangles that make the unit square of the plane z = 0, and the first one of them
# again in the plane z = -1.
SQUARE = oracles.Soup(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, -1), (1, 0, -1), (1, 1, -1)],
    [(0, 1, 2), (0, 2, 3), (4, 5, 6)],
)


@pytest.mark.parametrize(
    ("origin", "direction", "faces", "distance"),
    [
        # Down on the middle of the square: on the diagonal of both.
        ((0.5, 0.5, 1), (0, 0, -1), [0, 1], 0),
        # A quarter from the lower border; the length of the direction does not matter.
        ((0.75, 0.25, 1), (0, 0, -8), [0], 0.25),
        # Past a corner, along x and y.
        ((4, 5, 1), (0, 0, 1), [0, 1], 5),
        # 3 above the plane, in a plane of constant x, along the border x = 1.
        ((1, -7, 3), (0, 1, 0), [0], 3),
        # Skew lines: the diagonal and a line 2 above it, across it.
        ((1, 0, 2), (-1, 1, 0), [0, 1], 2),
        # In the plane and across all: it meets edges.
        ((-3, 0.25, 0), (1, 0, 0), [0], 0),
        # From the line to the end of an edge, beside which it runs past.
        ((-2, -2, 0), (1, -1, 0), [0, 1], 2 * math.sqrt(2)),
        # Behind the origin counts: it is the line that is asked about.
        ((0.5, 0.25, -1), (0, 0, -1), [0], math.sqrt(0.5) * 0.25),
        # So small that its square is no double.
        ((2.0**-149, 2.0**-149, 1), (0, 0, 1), [0], 0),
        ((-(2.0**-149), 0.5, 1), (0, 0, 1), [1], 2.0**-149),
        ((0, 0, 0), (1, 1, 1), [], math.inf),
    ],
)
def test_distances_by_hand(
    origin: tuple[float, ...],
    direction: tuple[float, ...],
    faces: list[int],
    distance: float,
) -> None:
    found = edge_distance(SQUARE, origin, direction, faces)
    assert found == pytest.approx(distance, rel=1e-15)


def test_distances_are_the_least_over_points_of_edges() -> None:
    """Against many points of each edge, in double."""
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 4)
    soup = oracles.Soup(vertices, faces)
    share = np.linspace(0, 1, 20001)[:, None]
    for origin, direction in zip(
        *workloads.into_box(rng, (vertices, faces), 20), strict=True
    ):
        unit = direction / np.linalg.norm(direction.astype(np.float64))
        least = math.inf
        for a, b in ((a, b) for f in faces for a, b in zip(f, np.roll(f, 1), strict=True)):
            points = vertices[a] + share * (vertices[b].astype(np.float64) - vertices[a])
            away = points - origin
            across = away - (away @ unit)[:, None] * unit
            least = min(least, float(np.linalg.norm(across, axis=1).min()))
        assert edge_distance(soup, origin, direction) == pytest.approx(least, abs=2e-5)


def test_faces_that_are_not_finite_have_no_edges() -> None:
    soup = oracles.Soup([(0, 0, 0), (1, 0, 0), (0, math.nan, 0)], [(0, 1, 2)])
    assert edge_distance(soup, (5, 5, 5), (0, 0, 1)) == math.inf


@dataclass(frozen=True)
class Claims:
    face: npt.NDArray[np.int32]

    @property
    def t(self) -> npt.NDArray[np.float32]:
        return np.zeros(len(self.face), np.float32)


def claims(*face: int) -> Claims:
    return Claims(np.array(face, np.int32))


def test_judgements_by_hand() -> None:
    origins = np.array(
        [
            (0.5, 0.5, 1),  # on the diagonal: faces 0 and 1 are both right
            (0.75, 0.25, 1),  # face 0
            (0.75, 0.25, -0.5),  # face 2
            (4, 5, 1),  # nothing
            (0.25, 0.75, 1),  # face 1, of which nobody disputes anything
        ],
        np.float32,
    )
    rays = origins, np.tile(np.array((0, 0, -1), np.float32), (5, 1))
    sides = {
        "right": claims(0, 0, 2, -1, 0),
        "also right": claims(1, 0, 2, -1, 0),
        "wrong": claims(-1, 2, 0, 1, 0),
    }
    judgement = adjudicate(SQUARE, rays, sides)
    assert [dispute.ray for dispute in judgement.disputes] == [0, 1, 2, 3]
    assert [dispute.verdicts["wrong"] for dispute in judgement.disputes] == [
        Verdict.LEAK,
        Verdict.WRONG_FACE,
        Verdict.WRONG_FACE,
        Verdict.FALSE_HIT,
    ]
    assert judgement.counts["wrong"] == {
        Verdict.LEAK: 1,
        Verdict.WRONG_FACE: 2,
        Verdict.FALSE_HIT: 1,
    }
    assert [judgement.wrong(name) for name in sides] == [0, 0, 4]
    assert [d.edge_distance for d in judgement.disputes] == [0, 0.25, 0.25, 5]


def test_judgements_know_intervals() -> None:
    rays = (
        np.array([(0.75, 0.25, 1)] * 3, np.float32),
        np.array([(0, 0, -1)] * 3, np.float32),
    )
    sides = {"a": claims(0, 2, -1), "b": claims(-1, -1, 2)}
    ends = (0, 1, 0), (1, 3, 0.5)
    judgement = adjudicate(SQUARE, rays, sides, *ends)
    assert [d.verdicts["a"] for d in judgement.disputes] == [Verdict.RIGHT] * 3
    assert [d.verdicts["b"] for d in judgement.disputes] == [
        Verdict.LEAK,
        Verdict.LEAK,
        Verdict.FALSE_HIT,
    ]
