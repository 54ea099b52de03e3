"""Checks of mesh files that Mitsuba does not make: it trusts the indices in PLY and
serialized files, and crashes on a face that refers to a vertex that does not exist, or on
a serialized file that is damaged; it takes OBJ files that are cut off; and it does not
count vertices that are not finite.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from . import obj_files, ply_files
from .errors import SceneError

SERIALIZED_MAGIC = 0x041C
SERIALIZED_NORMALS = 0x0001
SERIALIZED_TEXCOORDS = 0x0002
SERIALIZED_COLORS = 0x0008
SERIALIZED_DOUBLE = 0x2000

UNREADABLE = (OSError, ValueError, LookupError, StopIteration, struct.error, zlib.error)
"""What reading a damaged file may raise."""


def check_mesh_file(path: Path, plugin: str, shape_index: int = 0) -> None:
    """Raises SceneError if a face of the file refers to a vertex that does not exist, if an
    OBJ file is cut off, or if a serialized file is there but cannot be read.

    Any other defect is left for Mitsuba to report, which reads the file with all its
    contents.
    """
    try:
        defect = (
            obj_files.defect(path)
            if plugin == "obj"
            else bad_index(path, plugin, shape_index)
        )
    except UNREADABLE:
        if plugin != "serialized" or not path.is_file():
            return
        defect = "is damaged or no file of a serialized mesh: export it anew"
    if defect:
        raise SceneError(f"mesh file '{path}' {defect}")


def bad_index(path: Path, plugin: str, shape_index: int) -> str:
    """A complaint about a face of a PLY or serialized file, or nothing."""
    if plugin == "ply":
        indices, vertex_count = ply_files.triangle_indices(path)
    elif plugin == "serialized":
        indices, vertex_count = serialized_indices(path, shape_index)
    else:
        return ""
    bad = indices[(indices < 0) | (indices >= vertex_count)]
    if not bad.size:
        return ""
    return (
        f"has a face that refers to vertex {bad.flat[0]} of {vertex_count}: repair the "
        "mesh or export it anew"
    )


def bad_vertices(path: Path, plugin: str) -> tuple[int, int]:
    """How many vertices of a PLY or OBJ file are NaN or infinite, and how many there are.

    (0, 0) if that cannot be told.
    """
    try:
        points = (ply_files if plugin == "ply" else obj_files).positions(path)
    except UNREADABLE:
        return 0, 0
    return int(np.count_nonzero(~np.isfinite(points).all(axis=1))), len(points)


def serialized_indices(path: Path, shape_index: int) -> tuple[npt.NDArray[np.int64], int]:
    """Indices (F, 3) of a mesh in a file of Mitsuba's own format, and its number of
    vertices.

    The layout is documented with Mitsuba's `serialized` plugin: a file ends in the offsets
    of its meshes and their number, and a mesh is a version followed by a compressed stream.
    """
    data = path.read_bytes()
    magic, version = struct.unpack_from("<HH", data)
    if magic != SERIALIZED_MAGIC:
        raise ValueError("not a serialized mesh")
    (count,) = struct.unpack_from("<I", data, len(data) - 4)
    offset_type = "<Q" if version >= 4 else "<I"
    width = struct.calcsize(offset_type)
    (offset,) = struct.unpack_from(
        offset_type, data, len(data) - 4 - width * (count - shape_index)
    )
    body = zlib.decompressobj().decompress(data[offset + 4 :])
    (flags,) = struct.unpack_from("<I", body)
    position = 4
    if version >= 4:
        position = body.index(b"\0", position) + 1
    vertex_count, face_count = struct.unpack_from("<QQ", body, position)
    numbers = 3
    numbers += 3 if flags & SERIALIZED_NORMALS else 0
    numbers += 2 if flags & SERIALIZED_TEXCOORDS else 0
    numbers += 3 if flags & SERIALIZED_COLORS else 0
    real = 8 if flags & SERIALIZED_DOUBLE else 4
    start = position + 16 + vertex_count * numbers * real
    index = np.dtype("<u8" if vertex_count > 0xFFFFFFFF else "<u4")
    indices = np.frombuffer(body, index, 3 * face_count, start)
    return indices.astype(np.int64).reshape(-1, 3), vertex_count
