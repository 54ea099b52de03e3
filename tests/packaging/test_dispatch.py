"""MLRT_ISA chooses the native module, or says what there is to choose from."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from mlrt_plugin import _dispatch


def import_with(isa: str | None) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "MLRT_ISA"}
    if isa is not None:
        environment["MLRT_ISA"] = isa
    # -P: the installed package, not the source folder that may be the working directory.
    command = [sys.executable, "-P", "-c", "import mlrt_plugin; print(mlrt_plugin.isa)"]
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=120
    )


@pytest.mark.parametrize("isa", _dispatch.available_isas())
def test_override_is_obeyed(isa: str) -> None:
    run = import_with(isa)
    assert (run.returncode, run.stdout.strip()) == (0, isa), run.stderr


@pytest.mark.parametrize("isa", [None, ""])
def test_default_is_the_widest(isa: str | None) -> None:
    run = import_with(isa)
    assert (run.returncode, run.stdout.strip()) == (0, _dispatch.available_isas()[0]), (
        run.stderr
    )


@pytest.mark.parametrize("isa", ["avx1024", "../avx2", "AVX2 "])
def test_unknown_names_are_refused_with_the_choice(isa: str) -> None:
    run = import_with(isa)
    assert run.returncode != 0
    last = run.stderr.strip().splitlines()[-1]
    assert last.startswith("ImportError: MLRT_ISA=") and repr(isa) in last
    assert all(name in last for name in _dispatch.available_isas())
