"""mlrt-bench watertight and hits: what is counted, and that MLRT loses nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import workloads
from bench_command import assert_one_sentence, command
from mlrt_compare.bench import watertight, wrong_hits
from mlrt_compare.bench.adversarial import RAYS, SCENES, SmallScene
from mlrt_compare.bench.closed_meshes import sphere
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.hit_contenders import (
    FloatArray,
    HitArrays,
    HitContender,
    hit_contenders,
)
from mlrt_compare.bench.native import Native
from mlrt_compare.bench.watertight_command import meshes_to_keep

from mlrt_plugin import KdTree

SEED = 8
OWN = ["MLRT", "MLRT, wide tree", "MLRT, single rays"]
NAMES = [*OWN, "Embree default", "Embree robust"]


def test_contenders_hit_the_same_in_easy_cases(native: Native) -> None:
    rng = np.random.default_rng(SEED)
    vertices, faces = workloads.soup(rng, 200)
    rays = workloads.into_box(rng, (vertices, faces), 3001)
    contenders = hit_contenders(native, vertices, faces, 1)
    assert [contender.name for contender in contenders] == NAMES
    (t, face), *others = (contender.closest_hit(*rays) for contender in contenders)
    assert 0.3 < (face >= 0).mean() < 1
    for other_t, other_face in others:
        np.testing.assert_array_equal(other_face, face)
        np.testing.assert_allclose(other_t, t, rtol=1e-5)
    with pytest.raises(ValueError, match="same length"):
        scene = native.module.EmbreeScene(
            native.module.EmbreeDevice("threads=1"),
            native.module.Mesh(vertices, faces),
            False,
        )
        scene.closest_hit(*rays, np.zeros(2, np.float32), np.zeros(3001, np.uint32))


def test_leaks_are_counted() -> None:
    mesh = sphere(2)
    tree = KdTree(mesh.vertices, mesh.faces)
    field = watertight.range_of(mesh, SEED)

    def right(origins: FloatArray, directions: FloatArray) -> HitArrays:
        hits = tree.closest_hit(origins, directions)
        return hits.t, hits.primitive.astype(np.int64)

    def losing(origins: FloatArray, directions: FloatArray) -> HitArrays:
        t, face = right(origins, directions)
        # The ray's number, and one in seven is lost.
        face[::7] = -1
        return t, face

    for aim in watertight.AIMS:
        contenders = [HitContender("right", right), HitContender("losing", losing)]
        found = watertight.trace(field, contenders, aim, 700, SEED)
        assert (found["right"].count, found["losing"].count) == (0, 100)
        assert found["right"].rays == found["losing"].rays == 700
        assert len(found["losing"].examples) == watertight.KEPT


def test_those_to_compare_with_trace_a_share(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(watertight, "BATCH", 100)
    called = {"first": 0, "second": 0}

    def contender(name: str, face: int) -> HitContender:
        def closest_hit(origins: FloatArray, directions: FloatArray) -> HitArrays:
            called[name] += len(origins)
            count = len(origins)
            return np.ones(count, np.float32), np.full(count, face)

        return HitContender(name, closest_hit)

    field = watertight.range_of(sphere(1), SEED)
    contenders = [contender("first", 0), contender("second", -1)]
    found = watertight.trace(field, contenders, watertight.AIMS[0], 1750, SEED)
    assert (found["first"].rays, found["first"].count) == (1750, 0)
    # Batches 0 and 16, of 100 each.
    assert (found["second"].rays, found["second"].count) == (200, 200)
    assert called == {"first": 1750, "second": 200}


@pytest.mark.parametrize("aim", watertight.AIMS, ids=lambda aim: aim.name)
def test_rays_go_where_they_are_aimed(aim: watertight.Aim) -> None:
    mesh = sphere(2)
    field = watertight.range_of(mesh, SEED)
    rng = np.random.default_rng(SEED)
    origins, directions = watertight.rays(field, rng, aim, 10_000)
    starts = len(np.unique(origins, axis=0))
    assert starts == 3 if aim.share_origin else starts > 9_900
    ends = (origins + directions).astype(np.float64)
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    a = np.concatenate(list(np.moveaxis(corners, 1, 0)))
    b = np.concatenate(list(np.moveaxis(np.roll(corners, 1, axis=1), 1, 0)))
    for end in ends[::100]:
        along = np.einsum("ij,ij->i", end - a, b - a) / np.einsum("ij,ij->i", b - a, b - a)
        nearest = a + np.clip(along, 0, 1)[:, None] * (b - a)
        assert np.linalg.norm(nearest - end, axis=1).min() < 1e-6
        if aim.target == "vertices":
            assert np.linalg.norm(a - end, axis=1).min() < 1e-6


def test_rays_of_one_origin_are_neighbours() -> None:
    """Of a mesh with more faces than a run aims at: directions of a run differ less, and
    those in a row far less."""
    aims = {aim.share_origin: aim for aim in watertight.AIMS if aim.target == "vertices"}
    field = watertight.range_of(sphere(6), SEED)
    rng = np.random.default_rng(SEED)
    assert len(field.mesh.faces) == 4 * watertight.NEIGHBOURS
    turns = {}
    for share_origin, aim in aims.items():
        _, d = watertight.rays(field, rng, aim, watertight.SHARING)
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        turns[share_origin] = np.median(np.linalg.norm(d[1:] - d[:-1], axis=1))
        assert (np.linalg.norm(d.mean(axis=0)) > 0.5) == share_origin
    assert 20 * turns[True] < turns[False]


def test_wrong_hits_are_counted() -> None:
    """By hand: a square of two faces, and what can be wrong about it."""
    vertices = np.float32([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0)])
    scene = SmallScene("square", vertices, np.array([(0, 1, 2), (0, 2, 3)], np.uint32))
    targets = np.float32([(0.75, 0.25, 0), (0.25, 0.75, 0), (0.5, 0.5, 0), (2, 2, 0)] * 2)
    up = np.float32([(0, 0, 1)])
    exact = wrong_hits.ExactTriangles(vertices, scene.faces).nearest(
        targets + up, np.tile(-up, (8, 1))
    )
    assert exact.lowest().tolist() == [0, 1, 0, -1] * 2
    one = np.float32(1)
    after = np.nextafter(one, np.float32(2))
    inf = np.float32(np.inf)
    t = np.array([one, inf, after, one, one, np.float32(1.5), one, inf])
    face = np.array([0, -1, 1, 0, 1, 0, 0, -1])
    errors = wrong_hits.Errors()
    errors.add(exact, (t, face), np.ones(8, bool))
    assert errors == wrong_hits.Errors(
        misses=1,
        false_hits=1,
        wrong_faces=2,
        far_off=2,
        right=3,
        greatest_ulps=1,
        inexact=1,
    )
    assert errors.wrong == 4
    few = wrong_hits.Errors()
    few.add(exact, (t, face), np.arange(8) == 1)
    assert few == wrong_hits.Errors(misses=1)


def test_watertight_command(native: Native, cache: Path, tmp_path: Path) -> None:
    """A small number of the rays that the full run takes."""
    child = command(
        *(
            "watertight",
            "--rays",
            "6e5",
            "--meshes",
            "sphere,sphere at 10^6,slivers,absent.xml",
        ),
        *("--cache", cache, "--json", tmp_path / "figures.json"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert figures["benchmark"] == "watertight" and figures["settings"]["rays"] == 600_000
    *scenes, absent, absent_far = figures["scenes"]
    assert "there is no absent.xml" in absent["skipped"] and absent_far["skipped"]
    assert [scene["name"] for scene in scenes] == ["sphere", "sphere at 10^6", "slivers"]
    for scene in scenes:
        for row in scene["rows"]:
            assert list(row["leaks"]) == NAMES and row["rays"] == 600_000 // 30
            for name in OWN:
                assert row["leaks"][name] == {"rays": 20_000, "count": 0, "examples": []}
            assert f"{row['aim']}  " in child.stdout
    # Embree's default mode is known to lose rays at vertices.
    default = scenes[0]["rows"][0]["leaks"]["Embree default"]
    assert default["count"] > 1000 and len(default["examples"]) == watertight.KEPT
    assert figures["total"]["rays"] == 18 * 20_000
    assert [figures["total"]["leaks"][name] for name in OWN] == [0, 0, 0]
    assert figures["total"]["traced"] == dict.fromkeys(NAMES, 360_000)
    assert "MLRT: 0 of 360,000 rays escape" in child.stdout


def test_an_ended_run_is_continued(tmp_path: Path) -> None:
    """Meshes that it finished are kept; a run of other rays is not continued."""
    path = tmp_path / "figures.json"
    figures = {
        "benchmark": "watertight",
        "settings": {"rays": 6, "seed": 1, "threads": 2, "meshes": ["a", "b", "c"]},
        "machine": {"commit": "abc"},
        "scenes": [
            {"name": "a", "skipped": None, "rows": [1]},
            {"name": "b", "skipped": "there is no b"},
            {"name": "c", "skipped": None},
        ],
    }
    assert meshes_to_keep(path, figures) == []
    path.write_text(json.dumps(figures))
    assert meshes_to_keep(path, figures) == figures["scenes"][:1]
    other = figures | {"settings": {"rays": 7, "seed": 1, "meshes": ["a", "b", "c"]}}
    with pytest.raises(BenchError, match="another benchmark, number of rays"):
        meshes_to_keep(path, other)
    path.write_text("[]")
    with pytest.raises(BenchError, match="does not hold figures"):
        meshes_to_keep(path, figures)
    with pytest.raises(BenchError, match="--continue needs --json"):
        meshes_to_keep(None, figures)


def test_hits_command(native: Native, cache: Path, tmp_path: Path) -> None:
    child = command(
        *("hits", "--rays", 42_000, "--cache", cache),
        *("--json", tmp_path / "figures.json"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert len(figures["scenes"]) == len(SCENES)
    for scene in figures["scenes"]:
        assert [row["rays_of"] for row in scene["rows"]] == [make.__name__ for make in RAYS]
        for row in scene["rows"]:
            for own in (row["errors"][name] for name in OWN):
                assert own["wrong"] == own["inexact"] == 0
            assert list(row["errors"]) == NAMES
    errors = figures["total"]["errors"]
    assert figures["total"]["rays"] == 42_000
    assert errors["MLRT"]["right"] > 5_000
    assert errors["Embree default"]["misses"] > 0
    assert "all, MLRT " in child.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("watertight", "--rays", "many"), "'many' is not a number"),
        (("watertight", "--rays", "0.5"), "0.5 is not a whole number"),
        (("watertight", "--meshes", "cup"), "there is no mesh 'cup'"),
        (("hits", "--rays", "-1"), "-1 is not a whole number"),
        (("hits", "--threads", "9999"), "9999 threads are too many"),
        (("hits", "--json", "/no/where/x.json"), "there is no folder /no/where"),
    ],
)
def test_wrong_calls(arguments: tuple[str, ...], said: str) -> None:
    assert_one_sentence(command(*arguments), said)
