"""The most memory that a build and the frame after it take, found by processes that do
nothing else.

In a process that has built before, freed memory that the system never got back would hide
a part of it.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from mlrt_plugin.peak_memory import PeakMemory
from mlrt_plugin.threads import thread_count

from .contenders import WARM_UP_FACES, contenders_of, embree_device
from .native import loaded
from .scenes import BenchScene, read_stored, store

SIDE = 1024
"""Pixels along both sides of the frame, as usual."""


def resident_peaks(
    library: Path, scene: BenchScene, names: Iterable[str], threads: int
) -> dict[str, int | None]:
    """Bytes by the name of a contender; None where the system does not tell."""
    peaks: dict[str, int | None] = {}
    with tempfile.TemporaryDirectory(prefix="mlrt-bench-") as folder:
        file = Path(folder) / "scene.npz"
        store(file, scene)
        for name in names:
            # -P: a checkout that is the current folder holds packages without native core.
            command = [sys.executable, "-P", "-m", __name__, library, file, name, threads]
            child = subprocess.run(
                list(map(str, command)), capture_output=True, text=True, check=False
            )
            text = child.stdout.strip()
            peaks[name] = int(text) if child.returncode == 0 and text.isdecimal() else None
    return peaks


def grown_bytes(library: Path, file: Path, name: str, threads: int) -> int | None:
    """By how much the memory of this process grows at most while it builds and renders."""
    module = loaded(library)
    scene = read_stored(file, "")
    mesh = module.Mesh(scene.vertices, scene.faces)
    small_mesh = module.Mesh(scene.vertices, scene.faces[:WARM_UP_FACES])
    view = module.View(scene.view, SIDE, SIDE)
    image = np.zeros((SIDE, SIDE), np.float32)
    with thread_count(threads):
        device = embree_device(module, threads)
        contender = next(c for c in contenders_of(module, device) if c.name == name)
        # What stays whatever is built: threads, code, buffers of rays.
        contender.render(contender.build(small_mesh), view, image, None)
        module.release_memory()
        with PeakMemory() as peak:
            contender.render(contender.build(mesh), view, image, None)
    return peak.bytes


if __name__ == "__main__":
    print(grown_bytes(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4])))
