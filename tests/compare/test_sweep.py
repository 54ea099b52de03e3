"""Sweeps: every combination, resumable, nothing lost, on processes and on Dask."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import repository
from mlrt_compare.cli import main
from mlrt_compare.settings import Settings
from mlrt_compare.sweep import Job, Result, Results, locally, on_dask, sweep

SCENE = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"
SMALL = ("--resolution", "24x24", "--rounds", "1")


def run(*arguments: object) -> int:
    return main(["sweep", *map(str, arguments)])


def test_every_combination_is_run_once_and_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = (SCENE, *SMALL, "--spp", "1,2", "--seed", "0", "-o", tmp_path / "out")
    assert run(*options, "-j", 2) == 0
    told = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert [result["spp"] for result in told] == [1, 2]
    assert "not to be published" in (tmp_path / "out" / "sweep.md").read_text()
    files = {path: path.stat().st_mtime_ns for path in (tmp_path / "out/results").iterdir()}
    assert len(files) == 2
    capsys.readouterr()
    assert run(*options, "--seed", "0,5") == 0
    assert capsys.readouterr().out.count("(kept)") == 2
    again = {path: path.stat().st_mtime_ns for path in (tmp_path / "out/results").iterdir()}
    assert len(again) == 4 and files.items() <= again.items()


def test_a_scene_that_cannot_run_does_not_stop_the_others(tmp_path: Path) -> None:
    bad = tmp_path / "bad.xml"
    text = SCENE.read_text()
    bad.write_text(
        text.replace('<bsdf type="diffuse" id="red">', '<bsdf type="null" id="red">')
    )
    options = (bad, SCENE, *SMALL, "--spp", "1", "-o", tmp_path / "out")
    assert run(*options) == 4
    first, second = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert first["code"] == 4 and "error" in first
    assert second["code"] == 0 and second["passed"]
    assert "bad.xml" in (tmp_path / "out" / "sweep.md").read_text()


def test_a_killed_sweep_loses_nothing_and_continues(tmp_path: Path) -> None:
    command = [
        *(sys.executable, "-P", "-m", "mlrt_compare", "sweep", str(SCENE), *SMALL),
        *("--spp", "1,2,3,4", "-o", str(tmp_path / "out")),
    ]
    results = tmp_path / "out" / "results"
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, start_new_session=True
    ) as child:
        deadline = time.monotonic() + 120
        while time.monotonic() < deadline and child.poll() is None:
            if results.is_dir() and list(results.glob("*.json")):
                break
            time.sleep(0.05)
        os.killpg(child.pid, signal.SIGKILL)
    done = {path: path.stat().st_mtime_ns for path in results.glob("*.json")}
    assert 1 <= len(done) < 4
    assert all(json.loads(path.read_text())["passed"] for path in done)
    assert subprocess.run(command, stdout=subprocess.DEVNULL, timeout=300).returncode == 0
    again = {path: path.stat().st_mtime_ns for path in results.glob("*.json")}
    assert len(again) == 4 and done.items() <= again.items()


def test_folders_and_shading_reach_the_jobs(tmp_path: Path) -> None:
    meshes = tmp_path / "meshes"
    meshes.mkdir()
    (meshes / "wall.obj").write_text("v -9 -9 0\nv 9 -9 0\nv 0 9 0\nf 1 2 3\n")
    scene = tmp_path / "wall.xml"
    scene.write_text(
        """<scene version="3.0.0"><integrator type="direct"/><sensor type="perspective">
        <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/>
        </transform></sensor><shape type="obj"><string name="filename" value="wall.obj"/>
        </shape><emitter type="point"><point name="position" x="0" y="0" z="4"/></emitter>
        </scene>"""
    )
    options = (scene, *SMALL, "--spp", 1, "--shading", "native", "-a", meshes)
    assert run(*options, "-o", tmp_path / "out") == 0
    (told,) = json.loads((tmp_path / "out" / "sweep.json").read_text())
    assert told["shading"].startswith("native")
    names = [
        Job(Settings(SCENE, spp=1, shading=shading), 1).name()
        for shading in ("native", "mitsuba")
    ]
    assert len(set(names)) == 2


def jobs(*spp: int) -> list[Job]:
    return [Job(Settings(SCENE, spp=count), 1) for count in spp]


def counting(calls: list[list[str]], code: int = 0) -> Any:
    """An executor that runs nothing and answers at once."""

    def execute(waiting: Sequence[list[str]]) -> Iterator[tuple[int, Result]]:
        for number, job in enumerate(waiting):
            calls.append(job)
            yield number, {"code": code, "verdict": "PASS"}

    return execute


def test_what_is_kept_is_not_run_again_and_errors_are(tmp_path: Path) -> None:
    results, calls = Results(tmp_path), []
    for code, expected in ((4, 2), (0, 4), (0, 4)):
        sweep(jobs(1, 2), results, counting(calls, code), lambda *_: None)
        assert len(calls) == expected
    next(tmp_path.glob("*.json")).write_text("{ damaged")
    sweep(jobs(1, 2), results, counting(calls), lambda *_: None)
    assert len(calls) == 5
    sweep(jobs(3, 3, 3), results, counting(calls), lambda *_: None)
    assert len(calls) == 6, "the same job is run once"


def test_names_tell_jobs_apart(tmp_path: Path) -> None:
    copy = tmp_path / SCENE.name
    copy.write_text(SCENE.read_text().replace("0.73, 0.72, 0.69", "0.73, 0.72, 0.68"))
    names = {
        job.name()
        for job in (
            *jobs(1, 2),
            Job(Settings(SCENE, spp=1, seed=1), 1),
            Job(Settings(SCENE, spp=1, threads=1), 1),
            Job(Settings(SCENE, spp=1), 2),
            Job(Settings(SCENE, spp=1, resolution=(8, 8)), 1),
            Job(Settings(copy, spp=1), 1),
        )
    }
    assert len(names) == 7
    assert jobs(1)[0].name() in names


def test_an_interrupted_job_is_no_result(tmp_path: Path) -> None:
    def interrupted(waiting: Sequence[list[str]]) -> Iterator[tuple[int, Result]]:
        yield 0, {"code": 4, "error": "interrupted", "interrupted": True}

    with pytest.raises(KeyboardInterrupt):
        sweep(jobs(1), Results(tmp_path), interrupted, lambda *_: None)
    assert not list(tmp_path.iterdir())


def test_errors_of_local_jobs_are_told() -> None:
    ((number, result),) = locally(1)([["none.xml"]])
    assert (number, result["code"]) == (0, 4)
    assert "none.xml" in result["error"]


@pytest.mark.filterwarnings("ignore")
def test_on_a_dask_cluster(tmp_path: Path) -> None:
    distributed = pytest.importorskip(
        "distributed", reason="distributed is not installed: pip install 'mlrt[sweep]'"
    )
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        executor = on_dask(cluster.scheduler_address)
        small = [Job(Settings(SCENE, spp=spp, resolution=(24, 24)), 1) for spp in (1, 2)]
        found = sweep(small, Results(tmp_path), executor, lambda *_: None)
    assert [result["spp"] for result in found] == [1, 2]
    assert all(result["code"] == 0 for result in found)


@pytest.mark.filterwarnings("ignore")
def test_no_scheduler_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip(
        "distributed", reason="distributed is not installed: pip install 'mlrt[sweep]'"
    )
    options = (*SMALL, "-o", tmp_path / "out", "--dask", "nonsense")
    assert run(SCENE, *options) == 4
    assert "no Dask scheduler at nonsense" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "SCENE"),
        (("none.xml",), "none.xml"),
        ((SCENE, "-j", "0"), "0 is less than 1"),
        ((SCENE, "--resolution", "8x8,9"), "WIDTHxHEIGHT"),
        ((SCENE, "-o", SCENE), "not a folder"),
        ((SCENE, "-a", "nowhere"), "there is no folder 'nowhere'"),
    ],
)
def test_what_cannot_run_is_one_sentence(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[object, ...],
    said: str,
) -> None:
    output = () if "-o" in arguments else ("-o", tmp_path / "out")
    assert run(*arguments, *output) == 4
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and said in lines[0]
