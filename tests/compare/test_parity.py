"""Equal-sample parity: which rays differ, who is right, and what fails."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository

import mlrt_llvm

try:
    mlrt_llvm.activate()
except mlrt_llvm.LlvmUnavailable as error:
    pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}", allow_module_level=True)

import mitsuba as mi
from mlrt_compare.adjudication import Judgement, adjudicate, decided_by_rounding
from mlrt_compare.cli import main
from mlrt_compare.mlrt_renderer import MlrtRenderer
from mlrt_compare.parity import grown
from mlrt_compare.twin_hits import CLOSEST, SHADOW, Dispute, EmbreeHits, Rays, aligned

from mlrt_plugin import prepare
from mlrt_plugin._dispatch import core
from mlrt_plugin.hybrid.frame import render_frame

SCENES = repository.ROOT / "scenes"
BOX = SCENES / "cornell-box" / "cornell-box.xml"
SMALL = ("--resolution", "32x24", "--spp", "4", "--seed", "3")


@pytest.fixture(autouse=True)
def llvm_variant() -> Iterator[None]:
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("scalar_rgb")


def run(*arguments: object) -> int:
    return main(["parity", *map(str, arguments)])


def test_both_paths_of_a_folder(tmp_path: Path) -> None:
    """A file that is no scene is told of, and the others are judged."""
    folder = tmp_path / "scenes"
    folder.mkdir()
    text = BOX.read_text()
    (folder / "box.xml").write_text(text)
    (folder / "part.xml").write_text('<scene version="3.0.0"/>')
    figures, table = tmp_path / "parity.json", tmp_path / "parity.md"
    assert run(folder, *SMALL, "--json", figures, "--table", table) == 0
    rows = json.loads(figures.read_text())["scenes"]
    assert [(row["name"], row["path"]) for row in rows] == [
        ("box.xml", "native"),
        ("box.xml", "mitsuba"),
        ("part.xml", "native"),
    ]
    for row in rows[:2]:
        assert row["passed"] and row["rmse"] < 1e-4
        # A camera and a shadow ray a sample.
        assert row["rays"] == 2 * 4 * 32 * 24
        assert row["judgement"]["only_theirs"] == row["judgement"]["both_wrong"] == 0
    assert "no shapes" in rows[2]["error"]
    text = table.read_text()
    assert text.count("| pass |") == 2 and "- part.xml: scene" in text
    # Named by itself, it is a failure.
    assert run(folder / "part.xml", *SMALL) == 4


def test_an_image_that_is_off_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    image = MlrtRenderer.image.fget
    assert image is not None
    monkeypatch.setattr(MlrtRenderer, "image", property(lambda self: image(self) * 1.0005))
    assert run(BOX, *SMALL, "--shading", "native") == 2


@pytest.mark.parametrize("hide", [False, True])
def test_the_twin_is_mitsubas_direct(hide: bool) -> None:
    """What disputes are counted against is the image that parity is judged by."""
    counts = {"emitter_samples": 2, "bsdf_samples": 1}
    size = (24, 18)
    scene = prepare(BOX, shading="mitsuba", resolution=size, hide_emitters=hide)
    light = scene.light(EmbreeHits(scene), **counts)
    loaded = scene.loaded
    frame = render_frame(
        loaded.module, loaded.sensor, light, spp=4, seed=5, aovs=(), progress=None
    )
    direct = mi.load_dict({"type": "direct", "hide_emitters": hide, **counts})
    whole = mi.load_file(str(BOX), resx=size[0], resy=size[1], optimize=False)
    expected = np.array(mi.render(whole, integrator=direct, spp=4, seed=5))
    assert expected.any()
    np.testing.assert_allclose(frame.image(), expected, rtol=2e-6, atol=1e-7)


def rays_at(points: list[tuple[float, float]], answers: list[int], kind: str) -> Rays:
    """Rays along z, from z = -1 to 1, through points of the plane z = 0."""
    count = len(points)
    origins = np.array([(*point, -1) for point in points], np.float32)
    directions = np.tile(np.array([0, 0, 1], np.float32), (count, 1))
    ends = np.full(count, 2, np.float32)
    return Rays(kind, origins, directions, ends, np.array(answers, np.int64))


class OneTriangle:
    """Corners (0, 0), (1, 0) and (0, 1) in the plane z = 0."""

    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)
    faces = np.array([(0, 1, 2)], np.uint32)
    geometry: Any


ONE: Any = OneTriangle()
ONE.geometry = ONE
INSIDE, OUTSIDE, CORNER = (0.25, 0.25), (0.75, 0.75), (1.0, 0.0)


@pytest.mark.parametrize("kind", [CLOSEST, SHADOW])
def test_exact_arithmetic_judges(kind: str) -> None:
    hit, miss = (0, -1) if kind == CLOSEST else (1, 0)
    points = [INSIDE, OUTSIDE, CORNER, INSIDE]
    dispute = Dispute(
        np.arange(4),
        rays_at(points, [hit, hit, miss, miss], kind),
        rays_at([INSIDE, OUTSIDE, CORNER, OUTSIDE], [miss, miss, hit, hit], kind),
    )
    expected = Judgement(rays=4, only_ours=1, only_theirs=2, both_wrong=1)
    assert adjudicate([dispute], ONE, others=False) == expected
    # Something else may be in the way of a shadow ray.
    unknown = adjudicate([dispute], ONE, others=True).not_judged
    assert unknown == (0 if kind == CLOSEST else 4)


def test_rays_that_differ_may_both_be_right() -> None:
    dispute = Dispute(
        np.arange(1), rays_at([INSIDE], [0], CLOSEST), rays_at([OUTSIDE], [-1], CLOSEST)
    )
    assert adjudicate([dispute], ONE, others=False).both_right == 1
    beyond = rays_at([INSIDE], [0], SHADOW)
    beyond.ends[:] = 0.5
    assert adjudicate(
        [Dispute(np.arange(1), beyond, rays_at([INSIDE], [1], SHADOW))], ONE, others=False
    ) == Judgement(rays=1, both_right=1)


def test_shapes_that_are_no_meshes_are_not_judged() -> None:
    dispute = Dispute(
        np.arange(1), rays_at([INSIDE], [0], CLOSEST), rays_at([INSIDE], [-2], CLOSEST)
    )
    assert adjudicate([dispute], ONE, others=True).not_judged == 1
    assert adjudicate([dispute], None, others=True).not_judged == 1


def test_rounding_decides_at_edges_only() -> None:
    tree = core.KdTree(ONE.vertices, ONE.faces)
    points = [INSIDE, (0.5, 0.5), OUTSIDE, (0.25, 1e-3)]
    for kind in (CLOSEST, SHADOW):
        watched = [(np.array([7, 3, 5, 2]), rays_at(points, [0] * 4, kind))]
        assert decided_by_rounding(watched, tree).tolist() == [3]


def test_calls_through_lights_are_set_apart() -> None:
    """Mitsuba's side may go through one light more, or less."""

    def calls(*kinds: str) -> list[Rays]:
        return [rays_at([INSIDE], [number], kind) for number, kind in enumerate(kinds)]

    ours = calls(CLOSEST, CLOSEST, CLOSEST, SHADOW, CLOSEST)
    theirs = calls(CLOSEST, CLOSEST, SHADOW, CLOSEST)
    for pairs in (aligned(ours, theirs), aligned(theirs, ours)):
        assert [a.kind for a, _ in pairs] == [b.kind for _, b in pairs]
        assert len(pairs) == 4
    assert [int(a.answers[0]) for a, _ in aligned(ours, theirs)] == [0, 1, 3, 4]


def test_masks_grow_by_the_reach_of_the_filter() -> None:
    mask = np.zeros((5, 6), bool)
    mask[0, 2] = True
    expected = np.zeros((5, 6), bool)
    expected[:3, 0:5] = True
    np.testing.assert_array_equal(grown(mask, 2), expected)
    np.testing.assert_array_equal(grown(mask, 0), mask)
