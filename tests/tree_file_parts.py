"""Files of trees taken apart and put together, by the description of their format only."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

HEADER_SIZE = 72
LEAF = 3

Words = npt.NDArray[np.uint32]


@dataclass(frozen=True)
class Parts:
    """What a file holds; `nodes` (N, 2) as they are laid out."""

    format_version: int
    builder_version: int
    geometry: bytes
    description: bytes
    nodes: Words
    references: Words
    magic: bytes = b"\x89MLRT\r\n\x1a"

    @property
    def given(self) -> dict[str, Any]:
        given = json.loads(self.description)
        assert isinstance(given, dict)
        return given

    def but(self, **changes: Any) -> Parts:
        return replace(self, **changes)

    def with_node(self, index: int, payload: int, info: int) -> Parts:
        nodes = self.nodes.copy()
        nodes[index] = payload, info
        return self.but(nodes=nodes)

    def with_report(self, **changes: Any) -> Parts:
        given = self.given
        given["report"] |= changes
        return self.but(description=json.dumps(given).encode())


def inner(axis: int, split: float, child: int) -> tuple[int, int]:
    (bits,) = struct.unpack("<I", struct.pack("<f", split))
    return bits, child << 2 | axis


def leaf(first: int, count: int) -> tuple[int, int]:
    return first, count << 8 | LEAF


def join(parts: Parts) -> bytes:
    """The file, with the right checksum whatever the parts are."""
    body = parts.magic
    body += struct.pack("<II", parts.format_version, parts.builder_version)
    body += parts.geometry
    body += struct.pack(
        "<QQQ", len(parts.nodes), len(parts.references), len(parts.description)
    )
    body += parts.description
    body += parts.nodes.astype("<u4").tobytes() + parts.references.astype("<u4").tobytes()
    return body + struct.pack("<I", zlib.crc32(body))


def split(data: bytes) -> Parts:
    """The parts of a file that is as described."""
    (checksum,) = struct.unpack("<I", data[-4:])
    assert checksum == zlib.crc32(data[:-4])
    magic, format_version, builder_version = data[:8], *struct.unpack("<II", data[8:16])
    node_count, reference_count, size = struct.unpack("<QQQ", data[48:HEADER_SIZE])
    nodes_at = HEADER_SIZE + size
    references_at = nodes_at + 8 * node_count
    assert len(data) == references_at + 4 * reference_count + 4
    return Parts(
        format_version,
        builder_version,
        data[16:48],
        data[HEADER_SIZE:nodes_at],
        np.frombuffer(data[nodes_at:references_at], "<u4").reshape(-1, 2),
        np.frombuffer(data[references_at:-4], "<u4"),
        magic,
    )
