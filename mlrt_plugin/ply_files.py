"""The vertices and the indices of a PLY file of triangles, read apart from the rest."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

SCALARS = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
BYTE_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">", "ascii": ""}
LONGEST_HEADER = 65536
"""Bytes in which the header must end for the file to be looked at; chosen."""


@dataclass
class PlyElement:
    """A table of the file: its name, its rows, and the type of a row."""

    name: str
    count: int
    fields: list[tuple[str, str] | tuple[str, str, tuple[int]]] = field(
        default_factory=list
    )


@dataclass
class PlyHeader:
    """``byte_order`` is NumPy's, empty for text; ``size`` counts the bytes of the
    header."""

    byte_order: str
    elements: list[PlyElement]
    size: int


def read_header(head: bytes) -> PlyHeader:
    """Parses a header; raises ValueError if it is none, or holds what Mitsuba cannot read.

    A list is taken to have three entries: `triangle_indices` checks that.
    """
    end = head.index(b"end_header")
    size = head.index(b"\n", end) + 1
    order, elements = "", []
    for line in head[:end].decode("latin-1").splitlines():
        match line.split():
            case ["format", name, *_]:
                order = BYTE_ORDERS[name]
            case ["element", name, count]:
                elements.append(PlyElement(name, int(count)))
                if not 0 <= elements[-1].count < 2**32:
                    raise ValueError(f"an element {name} of {count} rows")
            case ["property", "list", count_type, item_type, name]:
                elements[-1].fields += [
                    (f"{name} count", order + SCALARS[count_type]),
                    (name, order + SCALARS[item_type], (3,)),
                ]
            case ["property", item_type, name]:
                elements[-1].fields.append((name, order + SCALARS[item_type]))
    return PlyHeader(order, elements, size)


def triangle_indices(path: Path) -> tuple[npt.NDArray[np.int64], int]:
    """Indices (F, 3) of the faces, and the number of vertices.

    Raises ValueError, KeyError or IndexError if the file is not a PLY file of triangles or
    ends too early.
    """
    with path.open("rb") as file:
        header = read_header(file.read(LONGEST_HEADER))
    vertex_count = next((e.count for e in header.elements if e.name == "vertex"), None)
    if vertex_count is None:
        raise ValueError("no vertices")
    read_faces = binary_faces if header.byte_order else text_faces
    counts, indices = read_faces(path, header)
    if not (counts == 3).all():
        raise ValueError("not a mesh of triangles")
    return indices, vertex_count


Faces = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]


def binary_faces(path: Path, header: PlyHeader) -> Faces:
    offset = header.size
    for element in header.elements:
        record = np.dtype(element.fields)
        if element.name == "face":
            # Before the file is mapped: NumPy dies of records without a field.
            name = index_field(element)
            table = np.memmap(path, record, "r", offset, (element.count,))
            return table[f"{name} count"].astype(np.int64), table[name].astype(np.int64)
        if any(len(f) == 3 for f in element.fields):
            raise ValueError("a list before the faces")
        offset += record.itemsize * element.count
    raise ValueError("no faces")


def text_faces(path: Path, header: PlyHeader) -> Faces:
    tokens = path.read_bytes()[header.size :].split()
    offset = 0
    for element in header.elements:
        width = sum(3 if len(f) == 3 else 1 for f in element.fields)
        if element.name == "face":
            end = offset + width * element.count
            table = np.array(tokens[offset:end]).astype(np.float64).astype(np.int64)
            table = table.reshape(element.count, width)
            name = index_field(element)
            column = 0
            for described in element.fields:
                if described[0] == name:
                    return table[:, column - 1], table[:, column : column + 3]
                column += 3 if len(described) == 3 else 1
        offset += width * element.count
    raise ValueError("no faces")


def positions(path: Path) -> npt.NDArray[np.float64]:
    """(V, 3) coordinates of the vertices, if they come first in the file.

    Raises as `triangle_indices` does.
    """
    with path.open("rb") as file:
        header = read_header(file.read(LONGEST_HEADER))
    vertices = header.elements[0]
    names = [f[0] for f in vertices.fields]
    columns = [names.index(axis) for axis in "xyz"]
    if header.byte_order:
        record = np.dtype(vertices.fields)
        table = np.memmap(path, record, "r", header.size, (vertices.count,))
        return np.stack([table[names[c]] for c in columns], axis=1).astype(np.float64)
    tokens = path.read_bytes()[header.size :].split()[: len(names) * vertices.count]
    rows = np.array(tokens).reshape(vertices.count, len(names))
    return rows[:, columns].astype(np.float64)


def index_field(face: PlyElement) -> str:
    """Name of the list of vertex indices, for which two spellings are in use; raises
    ValueError if there is none."""
    for name, *_ in face.fields:
        if name in ("vertex_indices", "vertex_index"):
            return name
    raise ValueError("faces without vertex indices")
