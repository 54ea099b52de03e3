"""mlrt-bench build as a command: figures, files, and one sentence for everything that goes
wrong."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository
from bench_command import assert_one_sentence, command
from bench_rays import expected_rays
from mlrt_compare.bench import native as bench_native
from mlrt_compare.bench.checkout import find_checkout
from mlrt_compare.bench.contenders import contenders_of, embree_device
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.native import Native, load_native
from mlrt_compare.bench.peak import resident_peaks
from mlrt_compare.bench.scenes import BenchScene, GeneratedScene
from numpy.typing import NDArray

from mlrt_plugin import KdTree
from mlrt_plugin.threads import thread_count

SCENE = repository.ROOT / "scenes" / "office" / "office.xml"
NODE_BYTES, REFERENCE_BYTES, TRIANGLE_BYTES = 8, 4, 36
ENDS = ("near", "far")
NAMES = ["MLRT exact", "MLRT fast", "MLRT lazy", "Embree MEDIUM", "Embree HIGH"]


@pytest.fixture(scope="module")
def measured(
    native: Native, cache: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, dict[str, Any], Path]:
    """What is printed, the figures, and the folder of a run on the office."""
    folder = tmp_path_factory.mktemp("measured")
    child = command(
        *("build", "--scenes", "office,absent.xml", "--repeats", 1),
        *("--resolution", 61, "--cache", cache),
        *("--json", folder / "figures.json", "--images", folder / "images"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    return child.stdout, json.loads((folder / "figures.json").read_text()), folder


def test_figures_are_whole(measured: tuple[str, dict[str, Any], Path]) -> None:
    _, figures, folder = measured
    assert (figures["benchmark"], figures["version"]) == ("build", 1)
    machine = figures["machine"]
    for key in ("processor", "cores", "memory_bytes", "kernel", "isa", "compiler"):
        assert machine[key]
    assert "-O3" in machine["flags"] and "-ffp-contract=off" in machine["flags"]
    assert machine["mitsuba"].count(".") == machine["drjit"].count(".") == 2
    scene = figures["scenes"][0]
    assert scene["name"] == "office" and scene["skipped"] is None
    assert [block["threads"] for block in scene["blocks"]] == [1, 2]
    for block in scene["blocks"]:
        assert block["embree"]["version"].startswith("3.")
        assert [contender["name"] for contender in block["contenders"]] == NAMES
        for contender in block["contenders"]:
            assert 1 <= len(contender["runs"]) <= 3
            for run in contender["runs"]:
                for part in (run["build"], run["frame"]):
                    assert part["wall"] > 0 and part["cpu"] >= 0 and part["waited"] >= 0
        assert [goal["name"] for goal in block["goals"]] == [
            "build fast / HIGH",
            "bytes fast / MEDIUM",
            "bytes fast / HIGH",
            "build + frame lazy / MEDIUM",
            "SAH cost fast / exact",
        ]
    # Nothing else is left behind.
    assert sorted(path.name for path in folder.iterdir()) == ["figures.json", "images"]


def test_figures_of_trees_are_those_of_the_plugin(
    measured: tuple[str, dict[str, Any], Path], office: BenchScene
) -> None:
    scene = measured[1]["scenes"][0]
    assert scene["triangles"] == len(office.faces)
    contenders = {c["name"]: c for c in scene["blocks"][0]["contenders"]}
    for builder in ("exact", "fast"):
        report = KdTree(office.vertices, office.faces, builder=builder).report
        name = f"MLRT {builder}"
        nodes = report["inner_nodes"] + report["leaves"]
        assert contenders[name]["bytes"] == (
            nodes * NODE_BYTES
            + report["references"] * REFERENCE_BYTES
            + len(office.faces) * TRIANGLE_BYTES
        )
        tree = KdTree(office.vertices, office.faces, builder=builder)
        assert contenders[name]["wide_bytes"] == tree.widen()
        assert all(run["wide"]["wall"] > 0 for run in contenders[name]["runs"])
        assert scene["sah_cost"][name] == pytest.approx(report["sah_cost"])
    for other in ("MLRT lazy", "Embree MEDIUM"):
        assert "wide_bytes" not in contenders[other]
        assert all(run["wide"] is None for run in contenders[other]["runs"])
    assert all(0 < share <= 1 for share in scene["built_share"].values())


def morton(side: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Columns and rows of a square of pixels, x in the even bits of the order."""
    index = np.arange(side * side)
    bits = range(side.bit_length() - 1)
    columns = sum(((index >> 2 * bit) & 1) << bit for bit in bits)
    rows = sum(((index >> (2 * bit + 1)) & 1) << bit for bit in bits)
    return columns, rows


def test_steps_are_those_of_packets_of_4_by_4_pixels(
    native: Native, office: BenchScene
) -> None:
    side = 64
    module = native.module
    tree = module.KdTree(module.Mesh(office.vertices, office.faces), {"builder": "exact"})
    options = {"traversal": "interval", "entry_points": False}
    counted = tree.count_primary(module.View(office.view, side, side), options)

    view = {key: np.asarray(value, np.float64) for key, value in office.view.items()}
    scale = 2 * view["tan_half_fov_x"]
    across, down = -scale / side * view["axis_x"], -scale / side * view["axis_y"]
    corner = view["axis_z"] + scale / 2 * (view["axis_x"] + view["axis_y"])
    x, y = (np.float32(n + 0.5)[:, None] for n in morton(side))
    directions = corner.astype(np.float32) + x * across.astype(np.float32)
    directions = directions + y * down.astype(np.float32)
    origins = np.broadcast_to(np.float32(view["origin"]), directions.shape)
    limits = [np.full(len(directions), view[f"{end}_clip"], np.float32) for end in ENDS]
    expected: dict[str, int] = {}
    plugin_tree = KdTree(office.vertices, office.faces, builder="exact")._tree
    plugin_tree.closest_hit(
        np.ascontiguousarray(origins), directions, *limits, options, expected
    )
    assert counted == expected
    assert counted["packets"] == side * side / 16


def test_engines_agree(measured: tuple[str, dict[str, Any], Path]) -> None:
    agreement = measured[1]["scenes"][0]["agreement"]
    assert agreement["mlrt_trees_give_one_image"]
    assert agreement["pixels"] == 61 * 61
    assert all(count <= 2 for count in agreement["differing"].values())


def test_table_and_images_are_there(measured: tuple[str, dict[str, Any], Path]) -> None:
    printed, _, folder = measured
    for name in NAMES:
        assert sum(line.startswith(name) for line in printed.splitlines()) == 2
        file = folder / "images" / f"office-{name.replace(' ', '-').lower()}.png"
        assert file.read_bytes().startswith(b"\x89PNG")
    assert "goals: best (median)" in printed


def test_missing_scene_is_skipped_by_name(
    measured: tuple[str, dict[str, Any], Path],
) -> None:
    printed, figures, _ = measured
    assert "absent: skipped, there is no absent.xml" in printed
    assert figures["scenes"][1]["name"] == "absent"
    assert "absent.xml" in figures["scenes"][1]["skipped"]


def test_nothing_to_measure_is_an_error(native: Native, cache: Path) -> None:
    child = command("build", "--scenes", "absent.xml", "--cache", cache)
    assert_one_sentence(child, "none of the scenes is there")


def test_frame_is_that_of_textbook_formulas(native: Native, office: BenchScene) -> None:
    """Of every contender, on a film of which no tile or packet is a part."""
    side = 37
    face, cosine, lit = expected_rays(office, side)
    brightness = np.where(lit, cosine, 0)
    assert 0.3 < lit.mean() < 0.99 and len(np.unique(face)) > 50
    module = native.module
    mesh = module.Mesh(office.vertices, office.faces)
    view = module.View(office.view, side, side)
    with thread_count(2):
        device = embree_device(module, 2)
        for contender in contenders_of(module, device):
            image = np.full((side, side), np.nan, np.float32)
            primitives = np.zeros((side, side), np.uint32)
            contender.render(contender.build(mesh), view, image, primitives)
            # Rays through edges and coincident faces may go either way.
            found = primitives.ravel().view(np.int32)
            assert np.mean(found != face) < 0.005, contender.name
            differing = np.abs(image.ravel() - brightness) > 1e-4
            assert np.mean(differing) < 0.005, contender.name


def test_embree_tells_what_it_holds(native: Native, office: BenchScene) -> None:
    module = native.module
    mesh = module.Mesh(office.vertices, office.faces)
    device = embree_device(module, 1)
    scene = module.EmbreeScene(device, mesh, True)
    assert 0 < scene.bytes <= scene.peak_bytes
    # A hierarchy over triangles holds their vertices: 36 bytes each at least.
    assert scene.bytes > TRIANGLE_BYTES * len(office.faces)


def test_peak_memory_holds_what_was_built(native: Native, cache: Path) -> None:
    scene = GeneratedScene("small", repository.ROOT / "scenes/dragon", 50_000).load(cache)
    names = ["MLRT fast", "MLRT lazy", "Embree MEDIUM"]
    peaks = resident_peaks(native.library, scene, names, 1)
    if None in peaks.values():
        pytest.skip("the system does not tell the peak of resident memory")
    mesh = native.module.Mesh(scene.vertices, scene.faces)
    device = embree_device(native.module, 1)
    for contender in contenders_of(native.module, device):
        if contender.name in names:
            # A page at either end of an array may have been there before.
            assert peaks[contender.name] > 0.9 * contender.build(mesh).bytes


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "command"),
        (("rebuild",), "rebuild"),
        (("build", "--repeats", "0"), "0 is not from 1"),
        (("build", "--threads", "1,two"), "'two' is not a whole number"),
        (("build", "--threads", "100000"), "100000 is not from 1"),
        (("build", "--threads", "1,16384"), "16384 threads are too many"),
        (("build", "--resolution", "-3"), "-3 is not from 1"),
        (("build", "--scenes", ","), "no scene is named"),
        (("build", "--scenes", "bunny"), "no scene 'bunny'"),
        (("build", "--json", SCENE.parent), "is a folder"),
        (("build", "--json", SCENE.parent / "no" / "such.json"), "no folder"),
        (("build", "--images", SCENE), "is not a folder"),
        (("rays", "--spp", "4"), "4 samples a pixel: choose 1 or 16"),
        (("rays", "--tiles", "16,24"), "24 is not a power of two"),
        (("rays", "--trace", "interval"), "'interval' is not of the form KEY=VALUE"),
        (("rays", "--json", SCENE.parent), "is a folder"),
        (("frames", "--spp", "0"), "0 is not from 1"),
        (("frames", "--scenes", "bunny"), "no scene 'bunny'"),
        (("build", "--source", SCENE.parent), "not a source checkout"),
        (("build", "--json", ""), "argument --json: an empty name is given"),
        (("build", "--source", ""), "argument --source: an empty name is given"),
        (("ats", "--markdown", ""), "argument --markdown: an empty name is given"),
        (("ats", "--markdown", SCENE.parent / "no" / "such.md"), "no folder"),
    ],
)
def test_what_cannot_run_is_one_sentence(
    tmp_path: Path, arguments: tuple[object, ...], said: str
) -> None:
    child = command(*arguments, *(("--cache", tmp_path) if arguments else ()))
    assert_one_sentence(child, said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["build", "rays", "ats", "watertight"])
def test_folder_that_cannot_be_made_is_one_sentence(tmp_path: Path, name: str) -> None:
    file = tmp_path / "file"
    file.write_text("")
    for cache in (file, file / "below", "/proc/foo"):
        child = command(name, "--cache", cache)
        assert_one_sentence(child, f"the folder {cache} for --cache cannot be made")
    child = command(name, "--cache", "")
    assert_one_sentence(child, "argument --cache: an empty name is given")


@pytest.mark.parametrize("name", ["build", "frames"])
def test_instruction_set_that_is_not_there_is_one_sentence(
    tmp_path: Path, name: str
) -> None:
    child = command(name, "--cache", tmp_path, MLRT_ISA="sse")
    assert_one_sentence(child, "mlrt-bench: MLRT_ISA='sse' is not available", "choose one")


def test_help_tells_the_exit_codes() -> None:
    child = command("--help")
    assert child.returncode == 0 and "Exit codes" in child.stdout


def test_checkout_is_found_around_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(SCENE.parent)
    assert find_checkout(None) == repository.ROOT
    assert_one_sentence(command("build", cwd=tmp_path), "--source")


def test_missing_tools_are_one_sentence_with_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(BenchError, match=r"'no-such-compiler'.*CXX"):
        bench_native.find_tools()
    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BenchError, match=r"cmake is missing: .*'mlrt\[bench\]'"):
        bench_native.find_tools()


BROKEN = 'message(FATAL_ERROR "broken on purpose")\n'


def test_sources_that_do_not_compile_are_one_sentence(tmp_path: Path) -> None:
    for folder, file in (("cpp", "core.cmake"), ("compare/benchmarks", "CMakeLists.txt")):
        (tmp_path / "source" / folder).mkdir(parents=True)
        (tmp_path / "source" / folder / file).write_text(BROKEN)
    with pytest.raises(BenchError, match=r"does not compile: see .*log\.txt"):
        load_native(tmp_path / "source", tmp_path / "cache")
    logs = list((tmp_path / "cache").rglob("log.txt"))
    assert len(logs) == 1 and "broken on purpose" in logs[0].read_text()
    assert not list((tmp_path / "cache").rglob("*.so"))


def test_key_depends_on_sources_and_compiler(tmp_path: Path) -> None:
    file = tmp_path / "cpp" / "a.h"
    file.parent.mkdir()
    file.write_text("int a;")
    before = bench_native.key_of(tmp_path, "avx2", "c++ 12")
    assert bench_native.key_of(tmp_path, "avx2", "c++ 12") == before
    assert bench_native.key_of(tmp_path, "avx2", "c++ 13") != before
    assert bench_native.key_of(tmp_path, "avx512", "c++ 12") != before
    file.write_text("int b;")
    assert bench_native.key_of(tmp_path, "avx2", "c++ 12") != before
