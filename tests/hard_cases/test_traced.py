"""All hard cases of tracing: every traversal, builder and number of rays is exact."""

from __future__ import annotations

from types import ModuleType

import pytest
from hard_cases import directions, edges, places, split_planes, unusual_geometry
from hard_cases.case import CASES, Listed
from hard_cases.running import check
from kd_trees import each_builder
from tracing import each_core

FAMILIES = (directions, edges, places, split_planes, unusual_geometry)


@each_core
@each_builder
@pytest.mark.parametrize("listed", CASES, ids=str)
def test_hits_are_exact(core: ModuleType, builder: str, listed: Listed) -> None:
    check(core, listed, builder)
