"""Splitting a tile deals out each of its rays once, in whole packets."""

from __future__ import annotations

from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tracing import each_core

PACKET = 16


@each_core
@pytest.mark.parametrize("split_factor", [4, 16])
@given(first=st.integers(0, 1000), count=st.integers(1, 70_000))
def test_children_partition_the_rays(
    core: ModuleType, split_factor: int, first: int, count: int
) -> None:
    children = core.mlrta_selftest.split_tile(first, count, split_factor)
    assert 1 <= len(children) <= split_factor
    end = first
    for start, size in children:
        assert start == end and size > 0
        end = start + size
    assert end == first + count
    assert all(size % PACKET == 0 for _, size in children[:-1])


@each_core
@pytest.mark.parametrize("split_factor", [4, 16])
def test_squares_split_into_equal_squares(core: ModuleType, split_factor: int) -> None:
    for side in (16, 32, 128):
        rays = side * side
        children = core.mlrta_selftest.split_tile(0, rays, split_factor)
        part = rays // split_factor
        assert children == [(i * part, part) for i in range(split_factor)]


@each_core
def test_a_packet_is_not_split(core: ModuleType) -> None:
    for count in (1, 15, 16):
        assert core.mlrta_selftest.split_tile(32, count, 16) == [(32, count)]
