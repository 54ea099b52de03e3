"""Trees in files.

A file is little-endian and has no gaps:

    8 bytes       MAGIC
    uint32        version of the format
    uint32        version of the builder
    32 bytes      digest of the triangles
    3 x uint64    how many nodes, references, and bytes of JSON follow
    JSON          an object: the build options and the builder's report
    2 x uint32    each node, as ``cpp/kdtree/node.h`` lays it out
    uint32        each reference
    uint32        CRC-32 of all bytes before

Triangles are not stored: whoever loads a tree has them. The CRC finds damage, at the speed
at which memory is copied, but not malice: whether nodes and references can be traversed is
checked by the core, whatever they are (``cpp/kdtree/serialize.h``).
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import struct
import zlib
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import drjit as dr
import numpy as np
import numpy.typing as npt

from mlrt_files import replacing

from ._dispatch import core
from .errors import TreeFileError

MAGIC = b"\x89MLRT\r\n\x1a"
"""As PNG's: a transfer that takes the file for text is noticed."""

FORMAT_VERSION = 1
DIGEST_SIZE = 32
HEADER = struct.Struct(f"<8sII{DIGEST_SIZE}sQQQ")
CHECKSUM = struct.Struct("<I")
NODE_SIZE, REFERENCE_SIZE = 8, 4

MAX_DESCRIPTION = 1 << 20
"""Bytes of JSON; chosen, far more than options and a report need."""

CHUNK = 1 << 22
"""Bytes that are read or written at a time; chosen, so that they stay in a cache between
the file, the checksum and the tree."""

BLOCK = 1 << 19
"""Triangles that a thread hashes at a time; part of the definition of their digest."""


class Header(NamedTuple):
    """The beginning of a file; its fields in order."""

    magic: bytes
    format_version: int
    builder_version: int
    geometry: bytes
    node_count: int
    reference_count: int
    description_size: int

    @property
    def file_size(self) -> int:
        return (
            HEADER.size
            + self.description_size
            + self.node_count * NODE_SIZE
            + self.reference_count * REFERENCE_SIZE
            + CHECKSUM.size
        )


def geometry_digest(triangles: npt.NDArray[np.float32]) -> bytes:
    """BLAKE2b of triangles (F, 9), that of the digests of their blocks.

    Two scenes must not share a digest, so a checksum would not do.
    """
    blocks = [triangles[i : i + BLOCK] for i in range(0, len(triangles), BLOCK)]

    def digest(block: npt.NDArray[np.float32]) -> bytes:
        return hashlib.blake2b(block.data, digest_size=DIGEST_SIZE).digest()

    threads = min(len(blocks), dr.thread_count())
    if threads > 1:
        with ThreadPoolExecutor(threads) as pool:
            digests = list(pool.map(digest, blocks))
    else:
        digests = [digest(block) for block in blocks]
    size = struct.pack("<Q", len(triangles))
    return hashlib.blake2b(size + b"".join(digests), digest_size=DIGEST_SIZE).digest()


def options_of_finished(options: Mapping[str, Any]) -> dict[str, Any]:
    """All build options, defaults included, that give the same finished tree.

    A lazy tree that has grown to its end is that of the fast builder, but for the order of
    its nodes.
    """
    found = dict(core.build_options(**options))
    if found["builder"] == "lazy":
        found["builder"] = "fast"
    return found


def file_name(geometry: bytes, options: Mapping[str, Any]) -> str:
    """A name that no other tree has: for the triangles' digest, options and versions."""
    versions = struct.pack("<II", FORMAT_VERSION, core.BUILDER_VERSION)
    canonical = json.dumps(options_of_finished(options), sort_keys=True)
    key = hashlib.blake2b(versions + geometry + canonical.encode(), digest_size=20)
    return f"{key.hexdigest()}.kdtree"


def save_tree(tree: Any, path: Path, geometry: bytes | None = None) -> None:
    """Writes a tree of the core, whole or not at all. Builds all of a lazy tree first.

    geometry: the digest of its triangles if it is known.

    Raises TreeFileError if that is not possible; the file is then as it was before.
    """
    core.finish_tree(tree)
    nodes, references = core.tree_nodes(tree), core.tree_references(tree)
    options = options_of_finished(core.tree_options(tree))
    description = json.dumps({"options": options, "report": tree.report})
    header = Header(
        MAGIC,
        FORMAT_VERSION,
        core.BUILDER_VERSION,
        geometry or geometry_digest(core.tree_triangles(tree)),
        len(nodes),
        len(references),
        len(description.encode()),
    )
    try:
        with new_file(path) as file:
            checksum = 0
            for part in (
                [HEADER.pack(*header), description.encode()],
                little_endian_chunks(nodes),
                little_endian_chunks(references),
            ):
                for chunk in part:
                    file.write(chunk)
                    checksum = zlib.crc32(chunk, checksum)
            file.write(CHECKSUM.pack(checksum))
    except OSError as error:
        raise TreeFileError(
            f"tree file '{path}' cannot be written: {error.strerror or error}"
        ) from error


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """A file under a temporary name beside `path`, which it replaces once it is on disk.

    Others see the old file or the new one, however many write at once. If anything fails,
    nothing is left.
    """
    with replacing(path, ".tmp") as temporary, temporary.open("xb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def little_endian_chunks(words: npt.NDArray[np.uint32]) -> Iterator[memoryview]:
    """The bytes of an array of words."""
    flat = words.reshape(-1)
    for i in range(0, len(flat), CHUNK // 4):
        yield flat[i : i + CHUNK // 4].astype("<u4", copy=False).data.cast("B")


def native_words(chunk: memoryview) -> npt.NDArray[np.uint8]:
    """Bytes of little-endian words as this machine orders them."""
    return np.frombuffer(chunk, "<u4").astype(np.uint32, copy=False).view(np.uint8)


def load_tree(
    path: Path,
    vertices: npt.NDArray[np.float32],
    faces: npt.NDArray[np.uint32],
    options: Mapping[str, Any],
) -> Any:
    """The tree of the core that a file holds for a mesh, vertices (V, 3) and faces (F, 3).

    Raises TreeFileError if it holds none that such options give, or cannot be trusted.
    """
    loader = core.TreeLoader(vertices, faces)
    return read_tree(path, loader, geometry_digest(loader.triangles), options)


def read_tree(path: Path, loader: Any, geometry: bytes, options: Mapping[str, Any]) -> Any:
    """As `load_tree`, of triangles that the core has already and their digest."""
    try:
        with opened(path) as file:
            size = os.fstat(file.fileno()).st_size
            header = read_header(file, size, geometry)
            loader.reserve(header.node_count, header.reference_count)
            description = read_parts(file, header, loader)
        given = parse_description(description)
        compare_options(given["options"], options_of_finished(options))
        return loader.finish(given["report"], **options)
    except (FileNotFoundError, NotADirectoryError):
        raise MissingTreeFile(f"tree file '{path}' does not exist") from None
    except OSError as error:
        reason = f"cannot be read: {error.strerror or error}"
    except MemoryError:
        reason = "is larger than the memory that is left"
    except ValueError as error:
        reason = str(error).rstrip(".")
        if not isinstance(error, Unusable):
            reason = f"is malformed: {reason}"
    raise TreeFileError(f"tree file '{path}' {reason}")


class MissingTreeFile(TreeFileError):
    """There is no such file."""


class Unusable(ValueError):
    """Why a file is refused; the message follows the name of the file."""


@contextmanager
def opened(path: Path) -> Iterator[BinaryIO]:
    """A regular file for reading; a pipe would keep its reader waiting."""
    # Without effect on regular files, which are the only ones that are read.
    nonblocking = getattr(os, "O_NONBLOCK", 0)
    binary = getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, os.O_RDONLY | nonblocking | binary), "rb") as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise Unusable("is not a regular file")
        yield file


def read_header(file: BinaryIO, size: int, geometry: bytes) -> Header:
    """The header of a file of `size` bytes that may hold a tree of some geometry."""
    data = file.read(HEADER.size)
    if not data.startswith(MAGIC[: len(data)]) or not data:
        raise Unusable("is not a file of a tree")
    if len(data) < HEADER.size:
        raise Unusable("is cut off in its header")
    header = Header(*HEADER.unpack(data))
    if header.format_version != FORMAT_VERSION:
        raise Unusable(
            f"has version {header.format_version} of the format, and only version "
            f"{FORMAT_VERSION} can be read"
        )
    if header.builder_version != core.BUILDER_VERSION:
        raise Unusable(
            f"is of version {header.builder_version} of the builder, which now has version "
            f"{core.BUILDER_VERSION}"
        )
    if header.geometry != geometry:
        raise Unusable("holds the tree of other geometry")
    if header.file_size != size:
        raise Unusable(
            f"has {size} bytes where its header promises {header.file_size}: it is cut off "
            "or damaged"
        )
    if header.description_size > MAX_DESCRIPTION:
        raise Unusable("is damaged: its description is too long")
    return header


def read_parts(file: BinaryIO, header: Header, loader: Any) -> bytes:
    """Reads all after the header: hands nodes and references on, returns the
    description."""
    checksum = zlib.crc32(HEADER.pack(*header))
    description = file.read(header.description_size)
    checksum = zlib.crc32(description, checksum)
    buffer = memoryview(bytearray(CHUNK))
    left = header.node_count * NODE_SIZE + header.reference_count * REFERENCE_SIZE
    while left > 0:
        chunk = buffer[: min(left, CHUNK)]
        if file.readinto(chunk) != len(chunk):  # type: ignore[attr-defined]
            raise Unusable("is cut off")
        checksum = zlib.crc32(chunk, checksum)
        loader.append(native_words(chunk))
        left -= len(chunk)
    if file.read(CHECKSUM.size) != CHECKSUM.pack(checksum):
        raise Unusable("is damaged: its checksum is wrong")
    return description


def parse_description(description: bytes) -> dict[str, dict[str, Any]]:
    """The options and the report in a description."""
    try:
        given = json.loads(description)
    except (ValueError, RecursionError):
        given = None
    if (
        not isinstance(given, dict)
        or not isinstance(given.get("options"), dict)
        or not isinstance(given.get("report"), dict)
    ):
        raise Unusable("is malformed: it has no options and no report")
    return given


def compare_options(stored: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    """Raises Unusable, which names an option, unless all are the same."""
    for name, value in wanted.items():
        if name not in stored or stored[name] != value:
            raise Unusable(
                f"holds the tree of other build options: {name} is "
                f"{shown(stored.get(name))}, not {shown(value)}"
            )
    if len(stored) != len(wanted):
        raise Unusable("holds the tree of other build options: there are more of them")


def shown(value: object) -> str:
    """A value as it was typed: the core keeps numbers in single precision."""
    return f"{value:g}" if isinstance(value, float) else str(value)[:40]
