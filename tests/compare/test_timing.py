"""Order of the timed frames, and what is derived from them."""

from __future__ import annotations

import pytest
from mlrt_compare.timing import Timings, frames_in_a_row, interleave


def test_order_is_a_b_b_a() -> None:
    calls: list[str] = []

    def record(name: str) -> float:
        calls.append(name)
        return float(len(calls))

    a, b = interleave(lambda: record("A"), lambda: record("B"), rounds=2)
    assert "".join(calls) == "ABBAABBA"
    assert (a, b) == ((1, 4, 5, 8), (2, 3, 6, 7))


def test_steady_is_the_median_and_jit_the_rest_of_the_first_frame() -> None:
    timings = Timings(1.0, None, 10.0, (2.0, 100.0, 3.0), kernels_compiled=2)
    assert timings.steady == 3
    assert timings.jit == pytest.approx(7)
    assert Timings(1.0, None, 10.0, (2.0,)).jit is None
    assert Timings(1.0, None, 1.0, (2.0,), kernels_compiled=2).jit == 0


def test_short_frames_are_measured_in_a_row() -> None:
    assert [frames_in_a_row(seconds) for seconds in (2.0, 0.05, 0.049, 0.002)] == [
        1,
        1,
        2,
        25,
    ]
    assert frames_in_a_row(0.0) >= 1  # a clock may have stood still
