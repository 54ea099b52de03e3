"""Ctrl-C ends a command of mlrt-compare with one line and 130, and leaves nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import repository

SCENE = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"

# The interrupt comes in the third frame, wherever that is.
INTERRUPTED_FRAME = """
import sys
from mlrt_compare import cli, llvm
llvm.activate()
from mlrt_compare.mlrt_renderer import MlrtRenderer
right, calls = MlrtRenderer.frame, []
def frame(renderer, *arguments, **options):
    calls.append(options)
    if len(calls) == 3:
        raise KeyboardInterrupt
    return right(renderer, *arguments, **options)
MlrtRenderer.frame = frame
sys.exit(cli.main(sys.argv[1:]))
"""

# It comes while Mitsuba's own code in Python runs, called by Dr.Jit.
INTERRUPTED_OPERATION = """
import sys
from mlrt_compare import cli, llvm
llvm.activate()
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
from mitsuba.python import util
def interrupted(*arguments):
    raise KeyboardInterrupt
util._RenderOp.eval = interrupted
sys.exit(cli.main(sys.argv[1:]))
"""


@pytest.mark.parametrize("command", ["scene", "speed-error", "parity"])
def test_an_interrupt_that_drjit_made_an_error_of(tmp_path: Path, command: str) -> None:
    more = ("--cache", tmp_path) if command == "speed-error" else ()
    arguments = (command, SCENE, "--resolution", "16x16", *more)
    child = subprocess.run(
        [sys.executable, "-P", "-c", INTERRUPTED_OPERATION, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=tmp_path,
    )
    assert child.returncode == 130, child.stdout + child.stderr
    assert child.stderr.splitlines()[-1] == "mlrt-compare: interrupted"
    assert "Traceback" not in child.stderr
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


@pytest.mark.parametrize(
    "command",
    [
        (SCENE, "--rounds", 2, "--spp", 1),
        ("speed-error", SCENE, "--spp", "1,2", "--rounds", 4, "--reference-factor", 1),
    ],
    ids=["scene", "speed-error"],
)
def test_an_interrupted_command_leaves_nothing(
    tmp_path: Path, command: tuple[object, ...]
) -> None:
    output = tmp_path / "out"
    arguments = (*command, "--resolution", "16x16", "-o", output)
    if "speed-error" in command:
        arguments = (*arguments, "--cache", tmp_path / "cache")
    child = subprocess.run(
        [sys.executable, "-P", "-c", INTERRUPTED_FRAME, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert child.returncode == 130, child.stderr
    assert child.stderr.splitlines()[-1] == "mlrt-compare: interrupted"
    assert "Traceback" not in child.stderr
    assert not output.exists()
    left = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert left == []


def test_an_interrupted_sweep_ends_and_keeps_no_half_result(tmp_path: Path) -> None:
    results = tmp_path / "out" / "results"
    command = [
        *(sys.executable, "-P", "-m", "mlrt_compare", "sweep", str(SCENE)),
        *("--spp", "1,2", "--rounds", "1", "--resolution", "16x16"),
        *("-o", str(tmp_path / "out")),
    ]
    with subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as child:
        deadline = time.monotonic() + 120
        while not results.is_dir() and time.monotonic() < deadline:
            time.sleep(0.02)
        time.sleep(0.2)  # the first job starts
        os.killpg(child.pid, signal.SIGINT)  # as a terminal does, to jobs as well
        _, errors = child.communicate(timeout=120)
    assert child.returncode == 130, errors
    assert errors.splitlines()[-1] == "mlrt-compare: interrupted"
    assert "Traceback" not in errors
    assert not list(results.iterdir())
    assert not (tmp_path / "out" / "sweep.json").exists()
