"""Tiles of disputed rays stand apart from a bias test, and hide nothing else."""

from __future__ import annotations

import numpy as np
import pytest

import mlrt_llvm

try:
    mlrt_llvm.activate()
except mlrt_llvm.LlvmUnavailable as error:
    pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}", allow_module_level=True)

from mlrt_compare.adjudication import Judgement
from mlrt_compare.bias import BiasTest
from mlrt_compare.disputed_tiles import DisputedTiles, bias_without

SEED = 20_261_128
TILES = (6, 7)


def renders(generator: np.random.Generator) -> np.ndarray:
    return generator.normal(1, 0.1, (32, *TILES))


def disputed(
    others: BiasTest | None, judgement: Judgement | None = None, rmse: float = 1e-6
) -> DisputedTiles:
    return DisputedTiles(16, 1000, judgement or Judgement(5, 5), rmse, 1, others)


def test_only_tiles_that_stand_apart_are_left_out() -> None:
    generator = np.random.default_rng(SEED)
    first, second = renders(generator), renders(generator)
    first[:, 2, 3] *= 1.5
    apart = np.zeros(TILES, bool)
    assert disputed(bias_without(apart, first, second)).reasons()
    apart[2, 3] = True
    others = bias_without(apart, first, second)
    assert others is not None and others.tiles == TILES[0] * TILES[1] - 1
    assert disputed(others).reasons() == []
    first[:, 4, 4] *= 1.2
    assert disputed(bias_without(apart, first, second)).reasons()
    assert bias_without(np.ones(TILES, bool), first, second) is None


def test_what_speaks_against_mlrt_within_these_tiles() -> None:
    generator = np.random.default_rng(SEED)
    apart = np.zeros(TILES, bool)
    right = bias_without(apart, renders(generator), renders(generator))
    assert disputed(right).reasons() == []
    wrong = Judgement(rays=5, both_right=3, only_theirs=1, both_wrong=1)
    for told, said in (
        (disputed(right, wrong), "MLRT answers 2 rays wrongly"),
        (disputed(right, rmse=1e-3), "with the same samples, pixels differ"),
        (disputed(right, rmse=float("nan")), "with the same samples, pixels differ"),
        (disputed(None), "in every tile"),
    ):
        assert any(said in reason for reason in told.reasons()), said
