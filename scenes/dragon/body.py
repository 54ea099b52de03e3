"""The dragon without its skin: the curve of the spine and the sizes of the cross-sections.

Metres, z up. A station is a point of the spine; between stations everything is a
Catmull-Rom spline (Catmull and Rom 1974) over the number of the station.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

# Position, direction of the back, half width, half height.
NECK_AND_HEAD = (
    ((0.60, 0.34, 0.98), (0.8, 0.4, 0.7), 0.36, 0.36),
    ((0.40, 0.66, 1.26), (0.6, 0.8, 0.4), 0.34, 0.34),
    ((0.02, 0.76, 1.64), (0.1, 1.0, 0.2), 0.31, 0.31),
    ((-0.26, 0.52, 2.02), (-0.2, 0.9, 0.5), 0.27, 0.27),
    ((-0.24, 0.10, 2.33), (-0.1, 0.5, 1.0), 0.235, 0.235),
    ((-0.08, -0.26, 2.42), (0.0, 0.2, 1.0), 0.23, 0.23),
    ((0.02, -0.50, 2.39), (0.0, 0.0, 1.0), 0.30, 0.27),
    ((0.09, -0.72, 2.33), (0.0, -0.1, 1.0), 0.31, 0.27),
    ((0.16, -0.94, 2.25), (0.0, -0.2, 1.0), 0.24, 0.19),
    ((0.22, -1.15, 2.18), (0.0, -0.2, 1.0), 0.19, 0.145),
    ((0.27, -1.33, 2.13), (0.0, -0.2, 1.0), 0.185, 0.14),
    ((0.305, -1.44, 2.10), (0.0, -0.2, 1.0), 0.14, 0.11),
    ((0.32, -1.485, 2.087), (0.0, -0.2, 1.0), 0.06, 0.05),
)
COIL_STATIONS = 26
HEAD = COIL_STATIONS + 5
"""Station at which the neck ends."""

SAMPLES_OF_A_STATION = 256


def coil() -> Floats:
    """The stations of the tail and the trunk, one row each: two turns that narrow and
    climb."""
    share = np.linspace(0, 1, COIL_STATIONS)
    angle = 2 * np.pi * 1.95 * (share - 1) + 0.15
    distance = np.interp(share, [0, 0.12, 0.5, 0.68, 1], [2.15, 1.75, 1.50, 1.0, 0.74])
    half = np.interp(share, [0, 0.1, 0.35, 0.6, 1], [0.02, 0.075, 0.22, 0.31, 0.37])
    climb = np.interp(share, [0, 0.48, 0.68, 1], [0, 0, 0.30, 0.42])
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack(
        [
            out * distance[:, None],
            half * 0.97 + climb,
            out * 0.45,
            np.ones_like(share),
            half,
            half,
        ]
    )


def stations() -> Floats:
    """(n, 8): position, direction of the back, half width, half height."""
    rest = [(*position, *back, w, h) for position, back, w, h in NECK_AND_HEAD]
    return np.vstack([coil(), rest])


def spline(knots: Floats, at: Floats) -> Floats:
    """Values at the station numbers ``at`` (k,) of a Catmull-Rom spline through ``knots``
    (n, c)."""
    last = len(knots) - 1
    i = np.clip(np.floor(at).astype(np.int64), 0, last - 1)
    t = (at - i)[:, None]
    # A phantom station beyond each end continues the line.
    padded = np.vstack([2 * knots[0] - knots[1], knots, 2 * knots[-1] - knots[-2]])
    a, b, c, d = (padded[i + k] for k in range(4))
    line = 2 * b + (c - a) * t
    bend = (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3
    return np.asarray(0.5 * (line + bend))


class Rings(NamedTuple):
    """Cross-sections along the spine, from the tail to the snout; every field has a row for
    each."""

    station: Floats
    """(n,) number of the station, with its fraction."""
    arc: Floats
    """(n,) metres along the spine from the tip of the tail."""
    turns: Floats
    """(n,) integral of d arc / radius: a square in (turns, angle) is one on the skin."""
    centre: Floats
    along: Floats
    """(n, 3) unit tangent, as are the next two: an orthonormal frame."""
    back: Floats
    side: Floats
    half_width: Floats
    half_height: Floats


def unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def rings(count: int) -> Rings:
    """``count`` cross-sections, denser where the body is thin and at the head."""
    knots = stations()
    station = np.linspace(0, len(knots) - 1, (len(knots) - 1) * SAMPLES_OF_A_STATION + 1)
    fine = spline(knots, station)
    step = np.linalg.norm(np.diff(fine[:, :3], axis=0), axis=1)
    radius = np.maximum(fine[:, 6], 0.02)
    middle = 0.5 * (radius[1:] + radius[:-1])
    weight = step / np.sqrt(middle) * np.where(station[1:] > HEAD, 1.8, 1.0)

    def total(parts: Floats) -> Floats:
        return np.concatenate([[0.0], np.cumsum(parts)])

    weights = total(weight)
    at = np.interp(np.linspace(0, weights[-1], count), weights, station)
    value = spline(knots, at)
    ahead = spline(knots, np.minimum(at + 1e-3, station[-1]))
    behind = spline(knots, np.maximum(at - 1e-3, 0))
    along = unit(ahead[:, :3] - behind[:, :3])
    back = value[:, 3:6]
    back = unit(back - along * np.sum(back * along, axis=1, keepdims=True))
    return Rings(
        station=at,
        arc=np.interp(at, station, total(step)),
        turns=np.interp(at, station, total(step / middle)),
        centre=value[:, :3],
        along=along,
        back=back,
        side=np.cross(along, back),
        half_width=value[:, 6],
        half_height=value[:, 7],
    )
