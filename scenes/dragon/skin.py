"""The skin of the dragon: how far each point of it stands off the smooth body.

Points of the skin are told by where they are along the body and by the angle around it, 0
at the back, pi at the belly, in radians.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from dragon.body import Floats, Rings

SCALES_AROUND = 44
PLATES_PER_TURN = 2.6
SPIKES_PER_TURN = 1.7
NOISE_ROWS = 1024
COARSEST_NOISE = 24
"""Cells of the coarsest noise around the body; each further octave has twice as many."""


class Feature(NamedTuple):
    """A bump of the head, one on each side."""

    station: float
    angle: float
    length: float
    """Standard deviation along the body, metres."""
    breadth: float
    """Standard deviation around the body, radians."""
    rise: float
    """Metres; negative for a hollow."""
    backward: float = 0.0
    """Metres that the top lies behind the foot."""


FEATURES = (
    Feature(32.15, 0.62, 0.055, 0.18, 0.36, 0.46),
    Feature(32.2, 1.55, 0.050, 0.15, 0.20, 0.24),
    Feature(32.0, 2.1, 0.050, 0.13, 0.15, 0.20),
    Feature(33.45, 0.72, 0.085, 0.17, 0.075, 0.04),
    Feature(33.62, 1.12, 0.075, 0.20, -0.045),
    Feature(33.62, 1.12, 0.042, 0.115, 0.075),
    Feature(36.1, 0.62, 0.040, 0.22, 0.045),
    Feature(36.25, 0.72, 0.020, 0.11, -0.045),
    Feature(34.6, 0.0, 0.20, 0.25, 0.025),
)


def smooth_step(low: float, high: float, x: Floats) -> Floats:
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def scales(turns: Floats, angle: Floats) -> Floats:
    """Overlapping scales in rows that are shifted by half a scale, 0 to 1."""
    across = angle * (SCALES_AROUND / (2 * np.pi))
    forward = turns * (SCALES_AROUND / (2 * np.pi) * 0.62)
    height = np.zeros(np.broadcast(across, forward).shape)
    for shift in (0.0, 0.5):
        p = np.mod(across + shift, 1) - 0.5
        # The free end of a scale points to the tail, where q is 0 again.
        q = np.mod(forward + shift, 1)
        outline = 1 - np.abs(2 * p) ** 2.2 - np.clip((0.32 - q) / 0.3, 0, 1) ** 2
        height = np.maximum(height, np.sqrt(np.clip(outline, 0, 1)) * (1 - 0.55 * q))
    return height


def noise(turns: Floats, angle: Floats, tables: list[Floats]) -> Floats:
    """Value noise, an octave a table; -1 to 1 for the first, half for each next one."""
    result = np.zeros(np.broadcast(turns, angle).shape)
    for octave, table in enumerate(tables):
        rows, columns = table.shape
        q, p = (x * (columns / (2 * np.pi)) for x in (turns, angle))
        i, j = (np.floor(x).astype(np.int64) for x in (q, p))
        s, t = (smooth_step(0, 1, x - k) for x, k in ((q, i), (p, j)))
        i0, i1, j0, j1 = i % rows, (i + 1) % rows, j % columns, (j + 1) % columns
        low = table[i0, j0] * (1 - t) + table[i0, j1] * t
        high = table[i1, j0] * (1 - t) + table[i1, j1] * t
        result += (low * (1 - s) + high * s) * 0.5**octave
    return result


def noise_tables(seed: int, around: int) -> list[Floats]:
    """Tables of noise down to cells of two edges of a mesh with ``around`` vertices around
    the body."""
    generator = np.random.default_rng(seed)
    tables = []
    cells = COARSEST_NOISE
    while cells <= max(around // 2, COARSEST_NOISE):
        tables.append(generator.uniform(-1, 1, (NOISE_ROWS, cells)))
        cells *= 2
    return tables


def feature_places(rings: Rings) -> Floats:
    """Where FEATURES are on a whole body, metres along the spine."""
    return np.interp([f.station for f in FEATURES], rings.station, rings.arc)


def skin(rings: Rings, angle: Floats, places: Floats, tables: list[Floats]) -> Floats:
    """Points of the skin of some of a body's ``rings`` at each ``angle``: (rings, angles,
    3), metres.

    ``places`` are the `feature_places` of the body, ``tables`` the `noise_tables`.
    """
    station, turns, width, height = (
        x[:, None]
        for x in (rings.station, rings.turns, rings.half_width, rings.half_height)
    )
    around = np.where(angle > np.pi, angle - 2 * np.pi, angle)[None, :]
    aside = np.abs(around)
    radius = np.minimum(width, height)
    head = smooth_step(31.3, 32.6, station)
    belly = smooth_step(2.05, 2.3, aside) * (1 - smooth_step(33.0, 34.0, station))

    plate = np.mod(turns * PLATES_PER_TURN, 1)
    plates = 0.085 * np.sqrt(np.clip(1 - (2 * plate - 1) ** 6, 0, 1)) * (0.6 + 0.4 * plate)
    cover = 0.075 * (1 - 0.6 * head) * scales(turns, angle[None, :])
    off = radius * (
        cover * (1 - belly)
        + plates * belly
        + 0.016 * (1 - 0.3 * head) * noise(turns, angle[None, :], tables)
    )
    behind = np.zeros_like(off)

    # The crest: spikes in a row along the back, the neck's the longest.
    spike = 1 - np.abs(2 * np.mod(turns * SPIKES_PER_TURN, 1) - 1)
    long = 0.30 + 0.28 * smooth_step(18, 30, station)
    crest = radius * long * spike**1.5 * np.exp(-((aside / 0.11) ** 2))
    crest = crest * (1 - smooth_step(33.2, 34.0, station))
    off += crest
    behind += 1.1 * crest

    for feature, place in zip(FEATURES, places, strict=True):
        distance = ((rings.arc - place) / feature.length) ** 2
        rows = distance < 16
        d = distance[rows, None]
        bump = np.exp(-d - ((aside - feature.angle) / feature.breadth) ** 2)
        off[rows] += feature.rise * bump
        behind[rows] += feature.backward * bump

    # The mouth, from the corner of the jaw around the snout.
    lip = 1.93 - 0.16 * smooth_step(33.5, 36.5, station)
    gape = np.exp(-(((aside - lip) / 0.075) ** 2)) * smooth_step(33.3, 34.2, station)
    off -= 0.45 * radius * gape * (1 - smooth_step(37.5, 38.0, station))

    cos, sin = np.cos(angle)[None, :, None], np.sin(angle)[None, :, None]
    back, side = rings.back[:, None], rings.side[:, None]
    w, h = width[..., None], height[..., None]
    normal = back * cos * w + side * sin * h
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    return np.asarray(
        rings.centre[:, None]
        + back * cos * h
        + side * sin * w
        + normal * off[..., None]
        - rings.along[:, None] * behind[..., None]
    )
