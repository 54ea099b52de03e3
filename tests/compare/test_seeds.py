"""Renders of different seeds are independent: a mean of many has the variance it must
have."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from mlrt_compare.seeds import spread_seeds

import mlrt_plugin

SIDE, GROUP = 48, 64
# Every pixel is noisy, and none by much more than the others: the light is not seen.
SCENE = """<scene version="3.0.0"><integrator type="direct"/><sensor type="perspective">
<transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><rfilter type="box"/></film></sensor>
<shape type="rectangle"><transform name="to_world"><scale value="9"/></transform></shape>
<shape type="rectangle"><transform name="to_world"><scale value="4"/>
<rotate x="1" angle="180"/><translate z="6"/></transform>
<emitter type="area"><rgb name="radiance" value="1"/></emitter></shape></scene>"""


def variance_ratio(scene: Path, seeds: Sequence[int]) -> float:
    """Of means of GROUP renders, over that of single ones divided by GROUP; 1 if they are
    independent. Above 1 if renders of a group are alike, below if they make up for each
    other."""
    prepared = mlrt_plugin.prepare(scene, resolution=(SIDE, SIDE))
    images = np.stack([prepared.render(spp=1, seed=seed).image[..., 0] for seed in seeds])
    groups = images.astype(np.float64).reshape(-1, GROUP, SIDE, SIDE)
    within = groups.var(axis=1, ddof=1).mean() / GROUP
    return float(groups.mean(axis=1).var(axis=0, ddof=1).mean() / within)


@pytest.mark.parametrize("spread", [False, True], ids=["neighbouring", "spread"])
@pytest.mark.parametrize("start", [0, 10**6])
def test_renders_of_different_seeds_are_independent(
    tmp_path: Path, full: bool, spread: bool, start: int
) -> None:
    groups = 128 if full else 16
    count = groups * GROUP
    seeds = spread_seeds(start, count) if spread else range(start, start + count)
    scene = tmp_path / "wall.xml"
    scene.write_text(SCENE)
    # Of a variance of so many pixels, each from as many groups; within is known better.
    error = np.sqrt(2 / (groups - 1)) / SIDE
    assert variance_ratio(scene, seeds) == pytest.approx(1, abs=5 * error)


def test_renders_that_are_alike_are_found(tmp_path: Path) -> None:
    """The measure tells: in each group every seed is there twice, so the variance of the
    mean is twice as large."""
    scene = tmp_path / "wall.xml"
    scene.write_text(SCENE)
    seeds = np.repeat(spread_seeds(1, 4 * GROUP), 2)
    assert variance_ratio(scene, [int(seed) for seed in seeds]) > 1.5
