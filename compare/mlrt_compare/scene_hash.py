"""A name for what an image depends on, so that what was rendered once can be kept."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from mlrt_plugin.elements import Element
from mlrt_plugin.parsing import parse_file, resolved, resolving_from

from .settings import Settings

BLOCK = 2**20


def scene_hash(settings: Settings) -> str:
    """SHA-256 of the scene with its $parameters, includes and files, of the sensor and of
    the resolution; not of samples, seed and threads.

    Two scenes with the same name are rendered alike, wherever they are. Raises SceneError
    if the scene cannot be read.
    """
    parsed = parse_file(settings.scene, settings.defines)
    digest = hashlib.sha256(repr((settings.sensor, settings.resolution)).encode())
    numbers = {id(element): number for number, element in enumerate(parsed.elements)}
    with resolving_from(parsed.folder):
        for element in parsed.elements:
            digest.update(repr((element.kind, element.plugin, element.id)).encode())
            for name, child in element.children:
                digest.update(repr((name, numbers.get(id(child), -1))).encode())
            add_properties(digest, element)
    return digest.hexdigest()


def add_properties(digest: Any, element: Element) -> None:
    """Adds values in full precision, and the bytes of every file that one names."""
    for name, value in sorted(element.properties.items()):
        digest.update(name.encode())
        if not isinstance(value, str):
            digest.update(exact_bytes(value))
            continue
        path = resolved(value)
        if path.is_file():
            with path.open("rb") as stream:
                while block := stream.read(BLOCK):
                    digest.update(block)
        else:
            digest.update(value.encode())


def exact_bytes(value: Any) -> bytes:
    """A property's value without the rounding of its printed form."""
    if isinstance(value, bool | int | float):
        return repr(value).encode()
    try:
        # Not by hasattr: an array of Dr.Jit takes any such word for a choice of components.
        if "Transform" in type(value).__name__:
            return np.asarray(value.matrix, np.float64).tobytes()
        return np.array([float(component) for component in value]).tobytes()
    except (TypeError, ValueError):
        return repr(value).encode()


def file_hash(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
