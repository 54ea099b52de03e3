"""mlrt-bench turns: two states of MLRT in processes of their own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import repository
from bench_command import assert_one_sentence, command
from bench_rays import expected_rays
from mlrt_compare.bench.commits import commit_named, sources_of
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.frame_runs import FrameSettings
from mlrt_compare.bench.native import Native, key_of
from mlrt_compare.bench.scenes import BenchScene
from mlrt_compare.bench.turns import BASE, NEW, Frames, Process, measure_turns

SETTINGS = FrameSettings(threads=(1,), repeats=2, resolution=37, spp=(1,))

needs_history = pytest.mark.skipif(
    not (repository.ROOT / ".git").exists(), reason="the sources are no git checkout"
)


def git(folder: Path, *arguments: str) -> str:
    own = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
    done = subprocess.run(
        ["git", "-C", str(folder), *own, *arguments],
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout.strip()


@pytest.fixture
def history(tmp_path: Path) -> Path:
    """A repository of two commits, of which the second one changes one source and adds what
    makes it a checkout."""
    root = tmp_path / "checkout"
    files = {
        "cpp/core.cmake": "# core",
        "compare/benchmarks/CMakeLists.txt": "# benchmarks",
        "cpp/base/vec.h": "// second",
        "README.md": "none of the sources",
    }
    git(tmp_path, "init", "-q", str(root))
    (root / "cpp/base").mkdir(parents=True)
    (root / "cpp/base/vec.h").write_text("// first")
    git(root, "add", "-A")
    git(root, "commit", "-q", "-m", "first")
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    git(root, "add", "-A")
    git(root, "commit", "-q", "-m", "second")
    (root / "cpp/base/vec.h").write_text("// changed since")
    return root


def test_sources_are_those_of_the_commit(history: Path, tmp_path: Path) -> None:
    for name in ("HEAD", git(history, "rev-parse", "--short", "HEAD")):
        commit = commit_named(history, name)
        assert commit == git(history, "rev-parse", "HEAD")
        folder = sources_of(history, commit, tmp_path / "cache")
        assert (folder / "cpp/base/vec.h").read_text() == "// second"
        assert not (folder / "README.md").exists()
    # A checkout without changes is compiled once for both.
    git(history, "checkout", "-q", "cpp")
    assert key_of(history, "isa", "c++") == key_of(folder, "isa", "c++")


def test_what_is_no_commit_is_refused(history: Path, tmp_path: Path) -> None:
    with pytest.raises(BenchError, match=r"has no commit '--help': name one"):
        commit_named(history, "--help")
    first = commit_named(history, "HEAD~1")
    with pytest.raises(BenchError, match=r"compare/benchmarks to compile .*name a later"):
        sources_of(history, first, tmp_path / "cache")
    assert not list((tmp_path / "cache").glob("commits/*"))
    with pytest.raises(BenchError, match="not a git repository"):
        commit_named(tmp_path, "HEAD")


def test_damaged_sources_are_fetched_again(history: Path, tmp_path: Path) -> None:
    commit = commit_named(history, "HEAD")
    folder = sources_of(history, commit, tmp_path)
    (folder / "cpp/core.cmake").unlink()
    assert sources_of(history, commit, tmp_path) == folder
    assert (folder / "cpp/core.cmake").read_text() == "# core"
    assert [path.name for path in folder.parent.iterdir()] == [commit]


def test_hits_of_a_process_are_those_of_textbook_formulas(
    native: Native, office: BenchScene
) -> None:
    face, _, lit = expected_rays(office, SETTINGS.resolution)
    with Process(NEW, native.library, office, SETTINGS) as process:
        traced = process.hits(Frames(1, True, 1, 1, hits=True))
        timing = process.timing(Frames(1, True, 1, 3))
    # Rays through edges and coincident faces may go either way.
    assert np.mean(traced.primitives.ravel().view(np.int32) != face) < 0.005
    assert np.mean(traced.lit.ravel().astype(bool) != lit) < 0.005
    assert timing.wall > 0 and timing.cpu > 0


def test_differences_are_counted(native: Native, office: BenchScene) -> None:
    """Of a process that has another scene, where a part of the faces is missing."""
    part = BenchScene(office.name, office.vertices, office.faces[:-200], office.view)
    wanted = Frames(1, False, 1, 1, hits=True)
    with (
        Process(NEW, native.library, office, SETTINGS) as whole,
        Process(BASE, native.library, part, SETTINGS) as smaller,
    ):
        a, b = (process.hits(wanted).primitives for process in (whole, smaller))
    gone = (a >= len(part.faces)) & (a < len(office.faces))
    assert gone.any() and np.array_equal(a != b, gone)


def test_what_goes_wrong_in_a_process_is_told(
    native: Native, office: BenchScene, tmp_path: Path
) -> None:
    libraries = {NEW: native.library, BASE: tmp_path / "_bench.so"}
    with pytest.raises(BenchError, match=r"base cannot be measured.*_bench\.so"):
        next(measure_turns(libraries, office, SETTINGS))
    with Process(BASE, native.library, office, SETTINGS) as process:
        process._process.kill()
        with pytest.raises(BenchError, match="the process of base ended before"):
            process.timing(Frames(1, False, 1, 1))


def test_interrupts_are_left_to_the_command(
    native: Native, office: BenchScene, capfd: pytest.CaptureFixture[str]
) -> None:
    """A terminal sends them to all processes. What still runs is ended and says nothing."""
    before = signal.getsignal(signal.SIGINT)
    with (
        pytest.raises(KeyboardInterrupt),
        Process(NEW, native.library, office, SETTINGS) as process,
    ):
        assert process._process.pid is not None
        os.kill(process._process.pid, signal.SIGINT)
        assert process.timing(Frames(1, False, 1, 1)).wall > 0
        process._pipe.send(Frames(1, False, 1, 10**9))
        raise KeyboardInterrupt
    assert not process._process.is_alive()
    assert capfd.readouterr().err == ""
    assert signal.getsignal(signal.SIGINT) is before


@needs_history
def test_command(native: Native, cache: Path, tmp_path: Path) -> None:
    changed = git(repository.ROOT, "status", "--porcelain", "cpp", "compare/benchmarks")
    if changed:
        pytest.skip("sources are changed: another module would have to be compiled")
    child = command(
        *("turns", "HEAD", "--scenes", "office,absent.xml", "--repeats", 2),
        *("--resolution", 32, "--spp", "1,16", "--threads", 1),
        *("--cache", cache, "--json", tmp_path / "turns.json"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    figures: dict[str, Any] = json.loads((tmp_path / "turns.json").read_text())
    assert figures["base"] == git(repository.ROOT, "rev-parse", "HEAD")
    office, absent = figures["scenes"]
    assert "absent.xml" in absent["skipped"]
    assert [(b["spp"], b["shadows"]) for b in office["blocks"]] == [
        *((1, False), (1, True), (16, False), (16, True))
    ]
    for block in office["blocks"]:
        assert set(block["differing"].values()) == {0}
        assert [each["name"] for each in block["contenders"]] == [NEW, BASE]
        assert all(len(each["runs"]) >= 2 for each in block["contenders"])
        assert block["speedup"]["best"] > 0
    assert child.stdout.count("spp primary") == 4


def test_wrong_calls_are_one_sentence(cache: Path) -> None:
    assert_one_sentence(command("turns"), "COMMIT")
    child = command("turns", "no-such-name", "--scenes", "office", "--cache", cache)
    assert_one_sentence(child, "has no commit 'no-such-name'")
