"""Small scenes and rays for hypothesis, which it shrinks to a few triangles and rays.

Most lie on a lattice of few points, where rays meet vertices and edges, run in planes, and
hit several triangles at once; others are arbitrary floats.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from workloads import FloatArray, Rays, Scene

LATTICE = 4
"""The greatest coordinate."""


@dataclass(frozen=True)
class Traced:
    """Triangles, and rays to trace through them."""

    vertices: FloatArray
    faces: np.ndarray
    origins: FloatArray
    directions: FloatArray

    @property
    def scene(self) -> Scene:
        return self.vertices, self.faces

    @property
    def rays(self) -> Rays:
        return self.origins, self.directions


def _vectors(count: int, *, lattice: bool) -> st.SearchStrategy[FloatArray]:
    if lattice:
        numbers = st.integers(-LATTICE, LATTICE).map(float)
    else:
        numbers = st.floats(-LATTICE, LATTICE, width=32, allow_subnormal=False)
    # A tiny number here would have products that underflow after scaling.
    numbers = numbers.filter(lambda x: x == 0 or abs(x) > 2.0**-30)
    # Without a fill, which would make most of the vectors equal.
    return arrays.arrays(np.float32, (count, 3), elements=numbers, fill=st.nothing())


@st.composite
def traced(draw: st.DrawFn, *, lattice: bool | None = None) -> Traced:
    """Up to 12 triangles over shared vertices, and up to 40 rays; those of about half of
    the examples share an origin."""
    on_lattice = draw(st.booleans()) if lattice is None else lattice
    vertices = draw(_vectors(draw(st.integers(3, 12)), lattice=on_lattice))
    corners = st.integers(0, len(vertices) - 1)
    count = draw(st.integers(1, 12))
    faces = draw(arrays.arrays(np.uint32, (count, 3), elements=corners, fill=st.nothing()))
    count = draw(st.integers(1, 40))
    origins = draw(_vectors(count, lattice=on_lattice))
    if draw(st.booleans()):
        origins[:] = origins[0]
    targets = draw(_vectors(count, lattice=on_lattice))
    return Traced(vertices, faces, origins, targets - origins)
