"""mlrt-bench rays: both engines find what textbook formulas say, in every mode, and the
command tells all of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository
from bench_command import assert_one_sentence, command
from bench_rays import expected_rays
from mlrt_compare.bench.contenders import embree_device
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.kernels import closed_meshes, rays_inside
from mlrt_compare.bench.native import INEXACT, WATERTIGHT, Native, load_native
from mlrt_compare.bench.rays import RayBenchmark, Settings, Traced, difference
from mlrt_compare.bench.scenes import BenchScene, scenes_of_rays
from numpy.typing import NDArray

from mlrt_plugin.threads import thread_count

GRIDS = {1: 1, 16: 4}
NO_TRIANGLE = 0xFFFFFFFF
NAMES = [
    "MLRT",
    *(
        f"Embree {quality} {mode}"
        for quality in ("MEDIUM", "HIGH")
        for mode in ("r16", "NM", "1M")
    ),
]
Render = Callable[..., Any]


@pytest.fixture(scope="module")
def renderers(native: Native, office: BenchScene) -> dict[str, Render]:
    """All ways to render the office, by name: called with the view, the image, and
    keywords of the native side."""
    module = native.module
    mesh = module.Mesh(office.vertices, office.faces)
    device = module.EmbreeDevice("threads=1,set_affinity=0")
    tree = module.KdTree(mesh, {"builder": "auto"})
    found: dict[str, Render] = {}
    for traversal in ("packet", "interval"):
        found[f"MLRT {traversal}"] = lambda view, image, t=traversal, **keywords: (
            tree.render(view, {"traversal": t}, image, **keywords)
        )
    for quality in ("MEDIUM", "HIGH"):
        scene = module.EmbreeScene(device, mesh, quality == "HIGH")
        for mode in ("r16", "NM8", "NM16", "1M"):
            found[f"Embree {quality} {mode}"] = (
                lambda view, image, s=scene, m=mode, **keywords: s.render(
                    view, image, mode=m, **keywords
                )
            )
    return found


def pixels(rays: NDArray[Any], spp: int) -> NDArray[Any]:
    """Means over the squares of rays that are pixels."""
    grid = GRIDS[spp]
    side = rays.shape[0] // grid
    return rays.reshape(side, grid, side, grid).mean(axis=(1, 3))


@pytest.mark.parametrize("spp", [1, 16])
@pytest.mark.parametrize("shadows", [False, True])
def test_rays_are_those_of_textbook_formulas(
    native: Native,
    office: BenchScene,
    renderers: dict[str, Render],
    spp: int,
    shadows: bool,
) -> None:
    """On a film of which no tile or packet is a part."""
    side, rays = 37, 37 * GRIDS[spp]
    face, cosine, unoccluded = (a.reshape(rays, rays) for a in expected_rays(office, rays))
    seen = unoccluded if shadows else face >= 0
    view = native.module.View(office.view, side, side, GRIDS[spp])
    with thread_count(2):
        for name, render in renderers.items():
            for tile in (4, 32, 256):
                image = np.full((side, side), np.nan, np.float32)
                primitives = np.zeros((rays, rays), np.uint32)
                lit = np.full((rays, rays), 2, np.uint8)
                seconds = render(
                    view, image, primitives=primitives, lit=lit, tile=tile, shadows=shadows
                )
                assert seconds.wall > 0
                # Rays through edges and coincident faces may go either way.
                where = f"{name}, tiles of {tile}"
                assert np.mean(primitives.view(np.int32) != face) < 0.005, where
                assert lit.max() <= 1 and np.mean(lit != seen) < 0.005, where
                expected = pixels(np.where(seen, cosine, 0), spp)
                assert np.mean(np.abs(image - expected) > 1e-4) < 0.02, where
                # What is written of each ray is what the image is made of.
                exact = pixels(np.where(lit == 1, cosine, 0), spp)
                same_hits = pixels((primitives.view(np.int32) == face) * 1.0, spp) == 1
                assert np.all(np.abs(image - exact)[same_hits] < 1e-4), where


def test_tiles_change_no_bit(
    native: Native, office: BenchScene, renderers: dict[str, Render]
) -> None:
    view = native.module.View(office.view, 61, 61)
    images = []
    for name in ("MLRT packet", "MLRT interval"):
        for tile in (4, 16, 128):
            images.append(np.zeros((61, 61), np.float32))
            renderers[name](view, images[-1], tile=tile)
    assert images[0].any()
    for image in images[1:]:
        assert np.array_equal(image.view(np.uint32), images[0].view(np.uint32))


def test_native_side_refuses_what_does_not_fit(
    native: Native, office: BenchScene, renderers: dict[str, Render]
) -> None:
    module = native.module
    with pytest.raises(ValueError, match="grid must be 1 or 4"):
        module.View(office.view, 8, 8, 2)
    view, image = module.View(office.view, 8, 8, 4), np.zeros((8, 8), np.float32)
    for name in ("MLRT packet", "Embree HIGH NM8"):
        for tile in (0, 2, 24, 8192):
            with pytest.raises(ValueError, match="tile must be a power of two"):
                renderers[name](view, image, tile=tile)
        with pytest.raises(ValueError, match=r"lit must have the shape \(32, 32\)"):
            renderers[name](view, image, lit=np.zeros((8, 8), np.uint8))
    scene = module.EmbreeScene(
        module.EmbreeDevice("threads=1"), module.Mesh(office.vertices, office.faces), False
    )
    with pytest.raises(ValueError, match="mode must be one of: r16, NM8, NM16, 1M"):
        scene.render(view, image, mode="r8")


def test_differences_are_counted_apart() -> None:
    own = Traced(
        np.array([[1, 2, NO_TRIANGLE, 4]], np.uint32),
        np.array([[1, 1, 0, 0]], np.uint8),
        np.array([[0.5, 0.5, 0.0, 0.0]], np.float32),
    )
    peer = Traced(
        np.array([[1, 3, 5, 4]], np.uint32),
        np.array([[1, 1, 1, 1]], np.uint8),
        np.array([[0.5, 0.5, 0.25, 0.25]], np.float32),
    )
    assert difference(own, own) == {"hit": 0, "triangle": 0, "lit": 0, "image": 0}
    assert difference(own, peer) == {"hit": 1, "triangle": 1, "lit": 1, "image": 2}


def test_usual_scenes_are_those_of_the_goals_and_the_atrium() -> None:
    names = [scene.name for scene in scenes_of_rays(repository.ROOT)]
    assert names == ["office", "conference", "building", "dragon-7.2M", "sponza"]


@pytest.fixture(scope="module")
def measured(
    native: Native, cache: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, dict[str, Any]]:
    """What is printed, and the figures, of a run on the office."""
    file = tmp_path_factory.mktemp("measured") / "figures.json"
    child = command(
        *("rays", "--scenes", "office,absent.xml", "--repeats", 1, "--resolution", 61),
        *("--tiles", "16,64", "--trace", "minimum_tile=8", "--cache", cache),
        *("--json", file),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    return child.stdout, json.loads(file.read_text())


def test_figures_are_whole(measured: tuple[str, dict[str, Any]]) -> None:
    _, figures = measured
    assert (figures["benchmark"], figures["version"]) == ("rays", 1)
    assert figures["machine"]["processor"] and "-O3" in figures["machine"]["flags"]
    assert figures["settings"]["trace"] == {"minimum_tile": 8}
    assert figures["settings"]["same_isa"] is False
    office, absent = figures["scenes"]
    assert office["skipped"] is None and "absent.xml" in absent["skipped"]
    assert office["embree"]["version"].startswith("3.")
    assert [(b["spp"], b["shadows"], b["threads"]) for b in office["blocks"]] == [
        (spp, shadows, threads)
        for spp in (1, 16)
        for shadows in (False, True)
        for threads in (1, 2)
    ]
    for block in office["blocks"]:
        primary = 61 * 61 * block["spp"]
        assert block["rays"]["primary"] == primary
        shadow = block["rays"]["shadow"]
        assert (0.5 * primary < shadow <= primary) if block["shadows"] else shadow == 0
        assert block["mlrt_tiles_give_one_image"]
        assert [contender["name"] for contender in block["contenders"]] == NAMES
        for contender in block["contenders"]:
            assert all(1 <= trial["frames"] <= 5 for trial in contender["tuning"])
            calls = 2 if contender["name"].endswith(("NM", "1M")) else 1
            assert len(contender["tuning"]) in (calls, 2 * calls)
            tried = {(trial["call"], trial["tile"]) for trial in contender["tuning"]}
            assert (contender["call"], contender["tile"]) in tried
            assert 1 <= len(contender["runs"]) <= 3
            for run in contender["runs"]:
                assert run["frames"] >= 1 and run["frame"]["wall"] > 0
            assert all(n <= 4 * block["spp"] for n in contender["differing"].values())


def test_goals_are_those_of_the_scene(measured: tuple[str, dict[str, Any]]) -> None:
    goals = {
        (block["spp"], block["shadows"]): (
            block["speedup"]["goal"],
            block["speedup"]["stretch"],
        )
        for block in measured[1]["scenes"][0]["blocks"]
    }
    assert goals == {
        (1, False): (4.5, 6.0),
        (1, True): (3.5, 5.0),
        (16, False): (4.0, None),
        (16, True): (None, None),
    }


def test_steps_of_the_three_baselines(measured: tuple[str, dict[str, Any]]) -> None:
    """What they are is tested where they are counted."""
    ats = measured[1]["scenes"][0]["ats"]
    assert ats["goal"] == 3.3
    assert ats["single_rays_from_the_root"] > ats["packets_from_the_root"]
    one, several = ats["with_entry_points"]
    assert (one["entry_points"], several["entry_points"]) == (1, 8)
    assert ats["packets_from_the_root"] > one["packets"] > several["packets"]
    assert one["cells"] == 0 < several["cells"]


def test_tables_are_there(measured: tuple[str, dict[str, Any]]) -> None:
    lines = measured[0].splitlines()
    for name in NAMES:
        assert sum(line.startswith(f"{name} ") for line in lines) >= 8
    assert any(line.startswith("  steps for 16 rays: single rays") for line in lines)
    for start in (
        "1 entry point, a cell 1 step: ",
        "up to 8 entry points, a cell 3 steps: ",
    ):
        assert any(line.startswith(f"  {start}") for line in lines)
    assert any(line.startswith("absent: skipped, there is no absent.xml") for line in lines)
    head = next(i for i, line in enumerate(lines) if line.startswith("MLRT / best Embree"))
    for what in ("1 spp primary", "1 spp primary + shadow", "16 spp primary"):
        assert what in lines[head]
    assert [line.split("  ")[0] for line in lines[head + 1 :]] == [
        *("office, 1 thread", "office, 2 threads")
    ]


def test_embree_may_be_limited_to_the_instruction_set_of_mlrt(native: Native) -> None:
    """Embree 3 has packets of 16 rays with AVX-512 only."""
    module = native.module
    native_packets = {
        isa: bool(embree_device(module, 1, isa).has_native_packets)
        for isa in ("avx2", "avx512")
    }
    assert not native_packets["avx2"]
    with pytest.raises(BenchError, match="cannot be limited to 'native': choose avx2 or"):
        embree_device(module, 1, "native")
    if module.isa == "avx512":
        assert native_packets["avx512"]
    settings = Settings((1,), 1, 16, (1,), (16,), {}, same_isa=True)
    scene = BenchScene(
        "one", np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.uint32), {}
    )
    device = RayBenchmark(native, scene, settings)._device
    assert bool(device.has_native_packets) == (module.isa == "avx512")


def test_options_that_the_tracer_does_not_have_are_one_sentence(
    native: Native, cache: Path
) -> None:
    child = command("rays", "--trace", "traversal=diagonal", "--cache", cache)
    assert_one_sentence(child, "--trace is refused", "traversal")


def test_cores_with_less_exactness_lack_it_and_little_else(
    native: Native, office: BenchScene, cache: Path, full: bool
) -> None:
    """They see the office as the exact one does, but for a few pixels at edges. The inexact
    one loses rays at vertices of a closed mesh, of which the others lose none; of the
    others one has distances of which some are not rounded correctly."""
    if not full:
        pytest.skip("compiles two more native sides, two minutes: pytest --full does")
    inexact = load_native(repository.ROOT, cache, INEXACT)
    watertight = load_native(repository.ROOT, cache, WATERTIGHT)
    modules = [native.module, inexact.module, watertight.module]
    assert [(module.exact, module.exact_distances) for module in modules] == [
        *((True, True), (False, False), (True, False))
    ]
    seen, leaks, distances = [], [], []
    mesh = closed_meshes(3)[0]
    origins, directions = rays_inside(mesh, "vertices", 4000, 1)
    for module in modules:
        tree = module.KdTree(module.Mesh(office.vertices, office.faces), {})
        view = module.View(office.view, 256, 256)
        primitives = np.zeros((256, 256), np.uint32)
        image = np.zeros((256, 256), np.float32)
        tree.render(view, {}, image, primitives=primitives)
        seen.append(primitives)
        ball = module.KdTree(module.Mesh(mesh.vertices, mesh.faces), {})
        t, face = np.empty(len(origins), np.float32), np.empty(len(origins), np.uint32)
        ball.trace_with("exact", origins, directions, t, face)
        leaks.append(int((face == NO_TRIANGLE).sum()))
        distances.append(t)
    for other in seen[1:]:
        assert np.count_nonzero(seen[0] != other) < 0.001 * seen[0].size
    assert leaks[0] == leaks[2] == 0 < leaks[1]
    assert np.any(distances[0] != distances[2])
    assert np.allclose(distances[0], distances[2], rtol=1e-5)
