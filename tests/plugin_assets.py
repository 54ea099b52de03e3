"""The files that the scenes of `plugin_scenes` refer to."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import scene_files


def write_assets(folder: Path) -> None:
    """The files that the scenes refer to."""
    random = np.random.default_rng(20_050_801)
    rgb = random.random((8, 16, 3), np.float32)
    mi.Bitmap(rgb).write(str(folder / "sky.exr"))
    mi.Bitmap((rgb * 255).astype(np.uint8)).write(str(folder / "image.png"))
    bent = np.stack(
        [rgb[..., 0] * 0.4 + 0.3, rgb[..., 1] * 0.4 + 0.3, np.ones((8, 16))], -1
    )
    mi.Bitmap(bent.astype(np.float32)).write(str(folder / "normals.exr"))
    (folder / "triangle.obj").write_text(scene_files.OBJ)
    (folder / "square.ply").write_bytes(scene_files.ply_bytes())
    (folder / "square.serialized").write_bytes(scene_files.serialized_bytes())
    points = [
        "-1.5 0.2 0 0.1",
        "-1 1 0 0.1",
        "-0.5 0.4 0.5 0.1",
        "0 1.2 0 0.1",
        "1 1 0 0.1",
    ]
    (folder / "curve.txt").write_text("\n".join(points) + "\n")
    write_grid(folder / "grid.vol")
    corners = [(-1.0, 0.0, 0.5), (-0.2, 0.0, 0.5), (-0.6, 0.9, 0.5)]
    (folder / "coloured.ply").write_text(coloured_ply(corners))
    (folder / "smooth.ply").write_text(smooth_ply())
    (folder / "ellipsoids.ply").write_text(ellipsoids_ply())


def write_grid(path: Path) -> None:
    """Distances from a ball in a grid of 12^3 points on the unit cube, in Mitsuba's volume
    format."""
    axis = np.linspace(0, 1, 12, dtype=np.float32)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt((x - 0.5) ** 2 + (y - 0.5) ** 2 + (z - 0.5) ** 2) - 0.35
    header = b"VOL" + bytes([3]) + np.array([1, 12, 12, 12, 1], "<i4").tobytes()
    box = np.array([0, 0, 0, 1, 1, 1], "<f4").tobytes()
    path.write_bytes(header + box + distance.astype("<f4").tobytes())


def coloured_ply(corners: list[tuple[float, float, float]]) -> str:
    lines = ["ply", "format ascii 1.0", f"element vertex {len(corners)}"]
    lines += [f"property float {name}" for name in ("x", "y", "z")]
    lines += [f"property float {name}" for name in ("r", "g", "b")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    for number_, corner in enumerate(corners):
        rgb = [0.2, 0.2, 0.2]
        rgb[number_ % 3] = 0.9
        lines.append(" ".join(str(value) for value in (*corner, *rgb)))
    return "\n".join([*lines, "3 0 1 2"]) + "\n"


def ellipsoids_ply() -> str:
    """Two ellipsoids: centre, logarithm of the axes, rotation."""
    names = ["x", "y", "z", "nx", "ny", "nz", "scale_0", "scale_1", "scale_2"]
    names += [f"rot_{i}" for i in range(4)]
    lines = ["ply", "format ascii 1.0", "element vertex 2"]
    lines += [f"property float {name}" for name in names]
    lines += [
        "end_header",
        "-1 0.6 0 0 0 0 -1 -1.5 -1 1 0 0 0",
        "0 0.6 0 0 0 0 -1.5 -1 -1 1 0 0 0",
    ]
    return "\n".join(lines) + "\n"


def smooth_ply() -> str:
    """A tent of two triangles with bent normals and texture coordinates."""
    names = ["x", "y", "z", "nx", "ny", "nz", "u", "v"]
    lines = ["ply", "format ascii 1.0", "element vertex 4"]
    lines += [f"property float {name}" for name in names]
    lines += ["element face 2", "property list uchar int vertex_indices", "end_header"]
    lines += ["-0.4 0.4 0.3 -0.6 0 0.8 0 0", "0.4 0.4 0.3 0.6 0 0.8 1 0"]
    lines += ["0 0.9 0.5 0 0.6 0.8 0.5 1", "0 0 0.5 0 -0.6 0.8 0.5 0"]
    return "\n".join([*lines, "3 0 1 2", "3 0 3 1"]) + "\n"
