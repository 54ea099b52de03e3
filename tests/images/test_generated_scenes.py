"""The office in the tree is what its generator writes."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

SCENES = Path(__file__).resolve().parents[2] / "scenes"


def contents(folder: Path) -> dict[str, bytes]:
    files = [*folder.glob("*.xml"), *folder.glob("meshes/*")]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def test_generator_writes_the_same_bytes(tmp_path: Path) -> None:
    runpy.run_path(str(SCENES / "office" / "generate.py"))["write"](tmp_path)
    assert contents(tmp_path) == contents(SCENES / "office")


def test_number_of_triangles_is_as_told() -> None:
    headers = [path.read_bytes() for path in (SCENES / "office" / "meshes").glob("*.ply")]
    faces = sum(int(re.search(rb"element face (\d+)", header)[1]) for header in headers)
    assert f"| {faces} |" in (SCENES / "README.md").read_text()
