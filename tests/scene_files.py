"""Small scenes and mesh files for tests."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

FILM = """<film type="hdrfilm">
    <integer name="width" value="16"/><integer name="height" value="12"/>
    <rfilter type="box"/>
</film>"""
SAMPLER = '<sampler type="independent"><integer name="sample_count" value="2"/></sampler>'
TO_WORLD = """<transform name="to_world">
    <lookat origin="0.3, 0.2, 5" target="0, 0.1, 0" up="0, 1, 0"/>
</transform>"""
SENSOR = f'<sensor type="perspective" id="eye">{TO_WORLD}{SAMPLER}{FILM}</sensor>'
LAMP = """<emitter type="point" id="lamp">
    <point name="position" value="1, 2, 3"/><rgb name="intensity" value="8, 7, 6"/>
</emitter>"""
FLOOR = '<shape type="rectangle" id="floor"/>'
DIRECT = (
    """<integrator type="direct"><integer name="bsdf_samples" value="0"/></integrator>"""
)


def scene_xml(
    *,
    shapes: str = FLOOR,
    emitters: str = LAMP,
    sensor: str = SENSOR,
    integrator: str = DIRECT,
    extra: str = "",
) -> str:
    """The XML of a scene: a rectangle in the light of a lamp unless told otherwise."""
    return f"""<?xml version="1.0" encoding="utf-8"?>
<scene version="3.0.0">
{integrator}
{sensor}
{emitters}
{shapes}
{extra}
</scene>
"""


def scene_dict(**more: Any) -> dict[str, Any]:
    """The scene of `scene_xml` as a dictionary without transformations."""
    return {
        "type": "scene",
        "integrator": {"type": "direct", "bsdf_samples": 0},
        "eye": {
            "type": "perspective",
            "sampler": {"type": "independent", "sample_count": 2},
            "film": {
                "type": "hdrfilm",
                "width": 16,
                "height": 12,
                "rfilter": {"type": "box"},
            },
        },
        "lamp": {"type": "point", "position": [1, 2, 3]},
        "floor": {"type": "rectangle"},
        **more,
    }


def mesh_shape(filename: str, more: str = "") -> str:
    """A shape element for a mesh file, its plugin told by the file's suffix."""
    plugin = Path(filename).suffix[1:]
    return (
        f'<shape type="{plugin}" id="mesh">'
        f'<string name="filename" value="{filename}"/>{more}</shape>'
    )


SQUARE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 0.0))
SQUARE_FACES = ((0, 1, 2), (1, 3, 2))


def ply_bytes(
    vertices: Sequence[Sequence[float]] = SQUARE,
    faces: Sequence[Sequence[int]] = SQUARE_FACES,
    *,
    text: bool = False,
    declared_faces: int | None = None,
) -> bytes:
    """A PLY file, little-endian unless `text`; it may declare more faces than it has."""
    count = len(faces) if declared_faces is None else declared_faces
    header = (
        f"ply\nformat {'ascii' if text else 'binary_little_endian'} 1.0\n"
        f"element vertex {len(vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {count}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    if text:
        lines = [" ".join(str(c) for c in v) for v in vertices]
        lines += [f"{len(f)} " + " ".join(str(i) for i in f) for f in faces]
        return header + "\n".join(lines).encode() + b"\n"
    body = b"".join(struct.pack("<3f", *v) for v in vertices)
    return header + body + b"".join(struct.pack(f"<B{len(f)}i", len(f), *f) for f in faces)


def serialized_bytes(
    vertices: Sequence[Sequence[float]] = SQUARE,
    faces: Sequence[Sequence[int]] = SQUARE_FACES,
) -> bytes:
    """A file of Mitsuba's `serialized` format, version 4, single precision, without
    normals."""
    body = (
        struct.pack("<I", 0x1000)
        + b"mesh\0"
        + struct.pack("<QQ", len(vertices), len(faces))
    )
    body += b"".join(struct.pack("<3f", *v) for v in vertices)
    body += b"".join(struct.pack("<3I", *f) for f in faces)
    return struct.pack("<HH", 0x041C, 4) + zlib.compress(body) + struct.pack("<QI", 0, 1)


OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
