"""mlrt-bench kernels: the tests of triangles find what NumPy does, and only exact ones find
all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench_command import assert_one_sentence, command
from mlrt_compare.bench.kernel_shadows import study_shadows
from mlrt_compare.bench.kernels import (
    AIMS,
    COHERENT,
    EXACT,
    TRAVERSALS,
    Contender,
    FloatArray,
    closed_meshes,
    compare,
    kernel_contenders,
    rays_inside,
    ties,
)
from mlrt_compare.bench.native import Native
from mlrt_compare.bench.offset_scene import Placement
from mlrt_compare.bench.offsets_command import measure

from mlrt_plugin import KdTree

SEED = 20261128
KERNELS = [
    "single precision",
    "double precision",
    "Plücker, single precision",
    "sheared, single precision",
    "exact",
]
NAMES = [*KERNELS, "MLRT as usual", *TRAVERSALS, "Embree default", "Embree robust"]


def test_hits_are_those_of_numpy(native: Native) -> None:
    """Möller and Trumbore in double precision, of rays at no edge."""
    mesh = closed_meshes(2)[0]
    origins, directions = rays_inside(mesh, "anywhere", 500, SEED)
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    a, e1, e2 = (
        corners[:, 0],
        corners[:, 1] - corners[:, 0],
        corners[:, 2] - corners[:, 0],
    )
    d = directions.astype(np.float64)[:, None]
    p = np.cross(d, e2)
    determinant = (p * e1).sum(axis=2)
    s = origins.astype(np.float64)[:, None] - a
    q = np.cross(s, e1[None])
    u, v = (s * p).sum(axis=2) / determinant, (q * d).sum(axis=2) / determinant
    t = (q * e2).sum(axis=2) / determinant
    t = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0), t, np.inf)
    nearest = t.argmin(axis=1)
    for contender in kernel_contenders(native, mesh.vertices, mesh.faces, 1):
        (found_t, face), seconds = contender.closest_hit(origins, directions)
        assert seconds > 0
        np.testing.assert_array_equal(face, nearest)
        exact = contender.name in (*EXACT, "double precision")
        tolerance = 1e-7 if exact else 1e-5
        np.testing.assert_allclose(found_t, t.min(axis=1), rtol=tolerance)


@pytest.mark.parametrize("aim", AIMS)
def test_only_exact_tests_find_all(native: Native, aim: str) -> None:
    wrong = dict.fromkeys(NAMES, 0)
    for mesh in closed_meshes(3):
        contenders = [
            contender
            for contender in kernel_contenders(native, mesh.vertices, mesh.faces, 1)
            if aim == "pixels" or contender.name not in COHERENT
        ]
        rows = compare(mesh, contenders, *rays_inside(mesh, aim, 4000, SEED), 1)
        expected = [name for name in NAMES if aim == "pixels" or name not in COHERENT]
        assert [row["name"] for row in rows] == expected
        for row in rows:
            wrong[row["name"]] += row["leaks"] + row["wrong_hits"]
            if row["name"] in EXACT:
                assert (row["other_hits"], row["inexact_t"]) == (0, 0)
                assert row["wrong_per_billion"] == 0
            # Other faces may tie, but a leak is always wrong.
            assert row["wrong_per_billion"] >= row["leaks"] / row["rays"] * 1e9
            if mesh.name == "ball in a ball" and row["name"] == "sheared, single precision":
                assert row["leaks"] == 0, "what leaks hits the outer ball"
    assert [wrong[name] for name in EXACT] == [0] * len(EXACT)
    if aim == "vertices":
        assert wrong["single precision"] > 100


def test_ties_at_vertices_are_told_from_wrong_faces() -> None:
    """Of an octahedron, whose vertices are exact: each of the four faces around one is as
    near as the others, and the opposite ones are not met."""
    mesh = closed_meshes(1)[0]
    tip = np.float32([0, 0, 1])
    touches = (mesh.vertices[mesh.faces] == tip).all(axis=2).any(axis=1)
    assert touches.sum() == 4
    faces = np.arange(len(mesh.faces))
    origins = np.zeros((len(faces), 3), np.float32)
    directions = np.repeat(tip[None], len(faces), axis=0)
    t = np.ones(len(faces), np.float32)
    assert (ties(mesh, origins, directions, faces, t) == touches).all()
    assert not ties(mesh, origins, directions, faces, np.nextafter(t, 2)).any()


def test_what_lies_behind_is_a_wrong_hit() -> None:
    """Of two balls, faces of the outer one. Where t alone is off, the hit is right."""
    mesh = closed_meshes(2)[-1]
    tree = KdTree(mesh.vertices, mesh.faces)
    outer = KdTree(mesh.vertices, mesh.faces[mesh.inner :])
    rays = rays_inside(mesh, "anywhere", 300, SEED)

    def exact(origins: FloatArray, directions: FloatArray) -> Any:
        hits = tree.closest_hit(origins, directions)
        return (hits.t, hits.primitive.astype(np.int64)), 1.0

    def flawed(origins: FloatArray, directions: FloatArray) -> Any:
        (t, face), seconds = exact(origins, directions)
        behind = outer.closest_hit(origins, directions)
        t[:7], face[:7] = behind.t[:7], behind.primitive[:7] + np.int64(mesh.inner)
        t[7:20] *= np.float32(1.5)
        t[20:25], face[20:25] = np.inf, -1
        return (t, face), seconds

    contenders = [Contender("exact", exact), Contender("flawed", flawed)]
    right, row = compare(mesh, contenders, *rays, 1)
    assert (right["leaks"], right["wrong_hits"], right["other_hits"]) == (0, 0, 0)
    assert (row["leaks"], row["wrong_hits"], row["other_hits"]) == (5, 7, 12)
    assert row["far_off"] == 7 and row["wrong_per_billion"] == 12 / 300 * 1e9
    assert row["inexact_t"] == 13 and row["ulps_max"] > 10**6


def test_shadow_rays_of_exact_tests_are_those_of_the_renderer(native: Native) -> None:
    """With robust offsets none is wrong, and with Mitsuba's as many pixels as the renderer
    gets wrong, but for what the other direction of its rays decides."""
    placement = Placement(size=1e-3)
    rows = study_shadows(native, placement, 40, 1, 1)
    assert [row["name"] for row in rows[::2]] == NAMES
    judgements, _ = measure("point", placement, 40)
    by_offset = {row["offset"]: row for row in rows if row["name"] == "exact"}
    robust, usual = by_offset["robust"], by_offset["mitsuba"]
    assert (robust["acne"], robust["leaks"], robust["other_hits"]) == (0, 0, 0)
    assert robust["lit"] > 300 and robust["dark"] > 100
    assert usual["leaks"] > 0
    assert abs(usual["leaks"] - judgements["mitsuba"].leaks) <= 0.1 * usual["leaks"] + 2


def test_the_command_tells_and_keeps_it(
    native: Native, cache: Path, tmp_path: Path
) -> None:
    file = tmp_path / "kernels.json"
    child = command(
        "kernels", "--rays", 2000, "--subdivisions", 2, "--threads", 1, "--repeats", 1,
        "--cache", cache, "--json", file, "--plot", tmp_path / "kernels.png",
        "--markdown", tmp_path / "kernels.md",
    )  # fmt: skip
    assert child.returncode == 0, child.stderr
    assert "ball, 128 faces, rays at vertices, 1 threads:" in child.stdout
    assert "| watertight + robust offset |" in child.stdout
    assert (tmp_path / "kernels.png").read_bytes().startswith(b"\x89PNG")
    figures = json.loads(file.read_text())
    page = (tmp_path / "kernels.md").read_text()
    assert page.count("\n## ") == 16 and page.count("\n| beams |") == 4
    assert [scene["name"] for scene in figures["scenes"]] == [
        "ball",
        "slivers",
        "ball at 10^4",
        "ball in a ball",
    ]
    for scene in figures["scenes"]:
        assert [block["aim"] for block in scene["blocks"]] == list(AIMS)


def test_what_the_native_side_refuses(native: Native) -> None:
    mesh = closed_meshes(1)[0]
    module = native.module
    tree = module.KdTree(module.Mesh(mesh.vertices, mesh.faces), {})
    rays = np.ones((4, 3), np.float32)
    t, face = np.empty(4, np.float32), np.empty(4, np.uint32)
    with pytest.raises(
        ValueError, match="kernel must be one of: single, double, pluecker, sheared, exact"
    ):
        tree.trace_with("half", rays, rays, t, face)
    with pytest.raises(ValueError, match="the same length"):
        tree.trace_with("exact", rays, rays[:3], t, face)
    assert_one_sentence(command("kernels", "--rays", "0"), "0 is not from 1 to")
    assert_one_sentence(command("kernels", "--plot", "x.txt"), "x.txt must be one of .png")
    child = command("kernels", "--markdown", "none/x.md")
    assert_one_sentence(child, "there is no folder none")
