"""Arrays of rays and of triangles of all kinds, shapes, layouts and values."""

from __future__ import annotations

from typing import Any

import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from fuzz_process import FuzzProcess
from hypothesis import given, settings
from hypothesis import strategies as st
from tracing import TRAVERSALS

from mlrt_plugin.options import BUILDERS

FUZZ = settings.get_profile("fuzz")
FLOATS = st.one_of(
    st.floats(-2, 2, width=32),
    st.sampled_from(
        [0.0, -0.0, np.nan, np.inf, -np.inf, 1e-45, -1e-45, 1e-38, 3e38, -3e38, 1e300, 0.5]
    ),
)
DTYPES = st.sampled_from(
    ["f4", "f8", "f2", "i4", "i8", "u1", ">f4", ">f8", "c8", "?", "O", "U3", "M8[s]", "g"]
)


@st.composite
def number_arrays(draw: Any, shape: tuple[int, ...]) -> Any:
    """An array of some dtype and layout; for most of them the numbers make sense."""
    dtype = np.dtype(draw(st.one_of(st.just("f4"), st.just("f8"), DTYPES)))
    values = draw(arrays.arrays(np.float64, shape, elements=FLOATS))
    with np.errstate(all="ignore"):
        try:
            array = values.astype(dtype)
        except (TypeError, ValueError, OverflowError):
            return values
    layout = draw(st.sampled_from(["C", "F", "strided", "reversed", "offset", "list"]))
    if layout == "F":
        return np.asfortranarray(array)
    if layout == "strided" and array.ndim:
        return np.repeat(array, 2, axis=0)[::2]
    if layout == "reversed" and array.ndim:
        return array[::-1].copy()[::-1]
    if layout == "offset" and array.itemsize > 1:
        raw = np.zeros(array.nbytes + 1, np.uint8)
        try:
            shifted = np.frombuffer(raw, array.dtype, array.size, 1).reshape(array.shape)
        except ValueError:
            return array
        shifted[...] = array
        return shifted
    return array.tolist() if layout == "list" else array


@st.composite
def shapes(draw: Any) -> tuple[int, ...]:
    """Mostly that of rays."""
    count = draw(st.sampled_from([0, 1, 2, 15, 16, 17, 33]))
    odd = [(count,), (count, 2), (3, count), (count, 3, 1), (), (count, 4)]
    return draw(st.one_of(st.just((count, 3)), st.just((count, 3)), st.sampled_from(odd)))


@st.composite
def bounds(draw: Any, count: int) -> Any:
    shape = draw(st.sampled_from([(), (), (count,), (1,), (count + 1,), (count, 1)]))
    return draw(st.one_of(FLOATS, number_arrays(shape)))


OPTIONS = st.fixed_dictionaries(
    {},
    optional={
        "traversal": st.sampled_from(["brute_force", *TRAVERSALS, "x", 3]),
        "entry_points": st.sampled_from([True, False, None, "yes", 1]),
        "initial_tile": st.sampled_from([1, 3, 16, 64, 1024, 0, -1, 2**40, "8", 1.5]),
        "minimum_tile": st.sampled_from([1, 16, 64, 0, 4096]),
        "split_factor": st.sampled_from([4, 16, 5]),
        "frontier": st.sampled_from([1, 7, 16, 17, 0]),
    },
)


@st.composite
def rays(draw: Any) -> tuple[Any, ...]:
    shape = draw(shapes())
    other = draw(st.one_of(st.just(shape), st.just(shape), shapes()))
    count = shape[0] if shape else 1
    return (
        draw(number_arrays(shape)),
        draw(number_arrays(other)),
        draw(bounds(count)),
        draw(bounds(count)),
        draw(OPTIONS),
    )


@given(rays())
@settings(FUZZ)
def test_rays(process: FuzzProcess, arguments: tuple[Any, ...]) -> None:
    process("ray_arrays", *arguments)


@st.composite
def meshes(draw: Any) -> tuple[Any, ...]:
    count = draw(st.integers(0, 12))
    vertices = draw(number_arrays((count, draw(st.sampled_from([3, 3, 3, 2])))))
    indices = st.one_of(st.integers(0, max(count - 1, 0)), st.integers(-3, 2**33))
    faces = draw(
        st.lists(st.lists(indices, min_size=3, max_size=3), max_size=40).map(
            lambda rows: np.array(rows, np.int64).reshape(-1, 3)
        )
    )
    kind = draw(st.sampled_from(["i8", "u4", "i4", "f4", "u1", ">i8"]))
    options = draw(
        st.fixed_dictionaries(
            {},
            optional={
                "builder": st.sampled_from([*BUILDERS, "best", 1]),
                "max_depth": st.sampled_from([0, 1, 40, 64, 1000, -1, "9"]),
                "area_floor": st.sampled_from([0, 0.5, 1, -1, np.nan, np.inf, "a"]),
                "empty_bonus": st.sampled_from([0, 0.8, 1, 2, -1, np.nan]),
                "intersection_cost": st.sampled_from([0, 1e-30, 1, 1e30, -1, np.nan]),
                "traversal_cost": st.sampled_from([0, 1, 1e38, np.inf]),
                "clip": st.sampled_from([True, False, "no"]),
                "empty_cell_share": st.sampled_from([0, 0.5, 1, -2, np.nan]),
            },
        )
    )
    with np.errstate(all="ignore"):
        return vertices, faces.astype(kind), options


@given(meshes())
@settings(FUZZ)
def test_meshes(process: FuzzProcess, arguments: tuple[Any, ...]) -> None:
    process("mesh_arrays", *arguments)


@st.composite
def raw_calls(draw: Any) -> tuple[str, list[Any]]:
    """Of the core, which must refuse by itself what it cannot take."""
    name = draw(st.sampled_from(["closest_hit", "any_hit", "KdTree"]))
    count = draw(st.integers(0, 20))
    rows = number_arrays((count, 3))
    if name == "KdTree":
        faces = draw(
            arrays.arrays(
                draw(st.sampled_from(["u4", "i8", "u2"])),
                (draw(st.integers(0, 5)), 3),
                elements=st.integers(0, 60),
            )
        )
        return name, [draw(rows), faces]
    line = number_arrays((draw(st.sampled_from([count, count, count + 1])),))
    return name, [draw(rows), draw(rows), draw(line), draw(line), draw(OPTIONS)]


@given(raw_calls())
@settings(FUZZ)
def test_core(process: FuzzProcess, call: tuple[str, list[Any]]) -> None:
    process("core_arrays", *call)


def test_what_should_be_done_and_refused(process: FuzzProcess) -> None:
    ray = np.zeros((1, 3)), np.ones((1, 3))
    assert process("ray_arrays", *ray, 0, np.inf, {}) == "done"
    refusal = process("ray_arrays", *ray, np.zeros(2), np.inf, {})
    assert refusal.startswith("refused: t_min must be a number or have the shape (1,)")
    with pytest.raises(AssertionError, match="KeyError"):
        process("no such case")
