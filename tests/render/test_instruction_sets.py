"""The picture is the same, bit for bit, on every instruction set."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mlrt_plugin._dispatch import available_isas

RENDER = """
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
import render_scenes
from core_scene import core, core_scene

for name in ("several", "gaussian border"):
    scene = core_scene(render_scenes.SCENES[name](Path(sys.argv[1])))
    answer = core.render(scene, 4, 9, {}, ["depth", "normal", "prim"])
    for picture in (answer["image"], *answer["aovs"].values()):
        sys.stdout.buffer.write(np.ascontiguousarray(picture).tobytes())
sys.stderr.write(core.isa)
"""


def test_pictures_of_all_instruction_sets_are_equal(tmp_path: Path) -> None:
    isas = available_isas()
    if len(isas) < 2:
        pytest.skip(f"this processor has one of the instruction sets only: {isas}")
    tests = str(Path(__file__).parents[1])
    pictures = set()
    for isa in isas:
        child = subprocess.run(
            [sys.executable, "-P", "-c", RENDER, str(tmp_path)],
            env=os.environ | {"MLRT_ISA": isa, "PYTHONPATH": tests},
            capture_output=True,
            check=True,
        )
        assert child.stderr.decode().endswith(isa)
        assert len(child.stdout) > 100_000
        pictures.add(child.stdout)
    assert len(pictures) == 1
