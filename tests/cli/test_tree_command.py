"""The command `mlrt tree`, and `--tree-cache`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files

from mlrt_plugin import prepare
from mlrt_plugin._dispatch import core
from mlrt_plugin.cli import main
from mlrt_plugin.options import BUILDERS
from mlrt_plugin.peak_memory import PeakMemory

SceneFile = Callable[..., Path]
Output = pytest.CaptureFixture[str]

LABELS_OF_MITSUBA = (
    "Primitive references",
    "kd-tree nodes",
    "kd-tree depth",
    "Leaf node histogram",
    "Largest leaf node",
    "Avg. prims/nonempty leaf",
    "Expected traversals/query",
    "Expected leaf visits/query",
    "Expected prim. visits/query",
    "Final cost",
)


def figures(argv: list[str], capsys: Output) -> dict[str, object]:
    """What the command prints with --json, which must be all that it prints."""
    assert main(["tree", *argv, "--json"]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    result = json.loads(printed.out)
    assert isinstance(result, dict)
    return result


def test_text(scene_file: SceneFile, capsys: Output) -> None:
    path = scene_file()
    assert main(["tree", str(path)]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    values = dict(
        (part.strip() for part in line.split(": ", 1))
        for line in printed.out.splitlines()
        if ": " in line
    )
    assert values.keys() >= set(LABELS_OF_MITSUBA)
    report = prepare(path).report
    assert values["kd-tree depth"] == str(report["depth"])
    assert values["Final cost"] == f"{report['sah_cost']:.2f}"
    assert values["Primitive references"].startswith(f"{report['references']} (")
    assert values[str(path)].startswith("load ")


def test_json(scene_file: SceneFile, capsys: Output) -> None:
    path = scene_file()
    found = figures([str(path)], capsys)
    prepared = prepare(path)
    for name, value in prepared.report.items():
        assert found[name] == value or name.startswith("seconds"), name
    assert found["scene"] == str(path)
    assert found["options"] == core.build_options()
    assert found["dropped_by_mesh"] == {}
    assert found.keys() >= {"seconds", "timings", "total_bytes", "references_per_triangle"}
    peak = found["peak_bytes"]
    assert peak is None or isinstance(peak, int)


@pytest.mark.skipif(sys.platform != "linux", reason="the system does not tell")
def test_peak_of_memory() -> None:
    with PeakMemory() as peak:
        del_me = np.ones(1 << 23)
        total = del_me.sum()
        del del_me
    assert total == 1 << 23
    assert peak.bytes is None or 60 << 20 < peak.bytes < 120 << 20


@pytest.mark.parametrize("builder", ["auto", "exact", "fast", "lazy"])
def test_builders(builder: str, scene_file: SceneFile, capsys: Output) -> None:
    path = scene_file()
    assert main(["tree", str(path), "--builder", builder]) == 0
    text = capsys.readouterr().out
    assert ("Built so far" in text) == (builder == "lazy")
    assert main(["render", str(path), "--builder", builder, "-v"]) == 0
    text = capsys.readouterr().out
    assert f"  builder: {'exact' if builder == 'auto' else builder}\n" in text
    assert "  built_share: " in text


FLAGS: dict[str, dict[str, object]] = {
    "--intersection-cost 3.5": {"intersection_cost": 3.5},
    "--no-clip --no-rule-flat-cell": {"clip": False, "rule_flat_cell": False},
    "--rule-area-floor --max-depth 2": {"max_depth": 2},
    "--builder fast": {"builder": "fast"},
}


@pytest.mark.parametrize("flags", FLAGS)
def test_options_of_the_builder(flags: str, scene_file: SceneFile, capsys: Output) -> None:
    found = figures([str(scene_file()), *flags.split()], capsys)
    assert found["options"] == core.build_options(**FLAGS[flags])


def test_each_option_has_a_flag(capsys: Output) -> None:
    with pytest.raises(SystemExit):
        main(["tree", "--help"])
    text = capsys.readouterr().out
    for name in core.build_options():
        assert f"--{name.replace('_', '-')}" in text


def test_builders_are_those_of_the_core() -> None:
    for name in BUILDERS:
        assert core.build_options(builder=name)["builder"] == name
    with pytest.raises(ValueError, match=f"one of: {', '.join(BUILDERS)}"):
        core.build_options(builder="slow")


@pytest.mark.parametrize(
    ("flags", "code", "expected"),
    [
        ("--max-depth 2.5", 2, "2.5"),
        ("--max-depth 65", 1, "max_depth"),
        ("--builder slow", 2, "'slow'"),
        ("--tree-cache=", 2, "the name of the folder is empty"),
        ("--empty-bonus 0", 1, "empty_bonus must be in"),
        ("-t 0", 1, "threads = 0"),
        ("-s 3", 1, "no sensor 3"),
        ("-D res=3", 1, "$res=3"),
    ],
)
def test_errors(
    flags: str, code: int, expected: str, scene_file: SceneFile, capsys: Output
) -> None:
    argv = ["tree", str(scene_file()), *flags.split(), "--json"]
    try:
        returned = main(argv)
    except SystemExit as exit_:
        returned = int(str(exit_.code))
    printed = capsys.readouterr()
    assert returned == code
    assert printed.out == ""
    (line,) = printed.err.splitlines()
    assert line.startswith("mlrt: error: ")
    assert expected in line


def test_dropped_triangles_are_told_by_mesh(
    scene_file: SceneFile, tmp_path: Path, capsys: Output
) -> None:
    corners = ((0, 0, 0), (1, 0, 0), (0, 1, 0), (2, 0, 0))
    line = scene_files.ply_bytes(corners, [(0, 1, 2), (0, 1, 3), (1, 1, 2)])
    (tmp_path / "line.ply").write_bytes(line)
    path = scene_file(shapes=scene_files.FLOOR + scene_files.mesh_shape("line.ply"))
    found = figures([str(path)], capsys)
    assert found["dropped_triangles"] == 2
    assert isinstance(found["dropped_by_mesh"], dict)
    ((name, count),) = found["dropped_by_mesh"].items()
    assert "'mesh'" in name
    assert count == 2
    assert main(["tree", str(path)]) == 0
    assert f"   2 of {name}" in capsys.readouterr().out.splitlines()


def test_cache(scene_file: SceneFile, tmp_path: Path, capsys: Output) -> None:
    path, cache = scene_file(), str(tmp_path / "cache")
    first = figures([str(path), "--tree-cache", cache], capsys)
    second = figures([str(path), "--tree-cache", cache], capsys)
    assert isinstance(first["timings"], dict)
    assert isinstance(second["timings"], dict)
    assert {"build", "save_tree"} <= set(first["timings"])
    assert set(second["timings"]) == {"load", "load_tree"}
    for figure in ("timings", "peak_bytes"):
        del first[figure], second[figure]
    assert first == second

    assert main(["render", str(path)]) == 0
    assert "build" in capsys.readouterr().out
    plain = np.array(mi.Bitmap(str(path.with_suffix(".exr"))))
    assert main(["render", str(path), "--tree-cache", cache]) == 0
    printed = capsys.readouterr()
    assert "load_tree" in printed.out
    assert "build" not in printed.out
    assert printed.err == ""
    cached = np.array(mi.Bitmap(str(path.with_suffix(".exr"))))
    assert plain.tobytes() == cached.tobytes()


@pytest.mark.parametrize("command", ["render", "tree"])
def test_a_damaged_cache_is_told_once(
    command: str, scene_file: SceneFile, tmp_path: Path, capsys: Output
) -> None:
    path, cache = scene_file(), tmp_path / "cache"
    argv = [command, str(path), "--tree-cache", str(cache)]
    assert main(argv) == 0
    (file,) = cache.iterdir()
    file.write_bytes(file.read_bytes()[:-1])
    capsys.readouterr()
    assert main(argv) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"mlrt: warning: tree file '{file}' has ")
    assert line.endswith("; the tree is built again")
    assert main(argv) == 0
    assert capsys.readouterr().err == ""
