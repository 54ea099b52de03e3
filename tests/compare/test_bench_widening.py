"""Frames are measured once trees have got their form for rays that go alone."""

from __future__ import annotations

import pytest
import repository
from mlrt_compare.bench import order
from mlrt_compare.bench.native import Native
from mlrt_compare.bench.scenes import BenchScene
from mlrt_compare.bench.widening import widen

import mlrt_plugin
from mlrt_plugin import KdTree

OFFICE = repository.ROOT / "scenes" / "office" / "office.xml"


def test_frames_after_widening_leave_the_tree_as_it_is() -> None:
    prepared = mlrt_plugin.prepare(OFFICE, resolution=(64, 64))
    assert prepared.report["wide_bytes"] == 0
    took = widen(prepared)
    assert took is not None and took.wall > 0
    made = prepared.report["wide_bytes"]
    assert made > 0
    for _ in range(3):
        prepared.render(spp=4)
    assert prepared.report["wide_bytes"] == made


def test_lazy_trees_have_no_wide_form() -> None:
    prepared = mlrt_plugin.prepare(OFFICE, resolution=(8, 8), builder="lazy")
    assert widen(prepared) is None
    assert prepared.report["wide_bytes"] == 0


def test_orders_begin_with_a_wide_tree(
    native: Native, office: BenchScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    trees: list[KdTree] = []

    class Known(KdTree):
        def __init__(self, *arguments: object, **options: object) -> None:
            super().__init__(*arguments, **options)  # type: ignore[arg-type]
            trees.append(self)

    monkeypatch.setattr(order, "KdTree", Known)
    order.contenders(native, office, 1)
    assert [tree.report["wide_bytes"] > 0 for tree in trees] == [True]
