"""A folder of trees, each in a file whose name tells what it was built for."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .errors import TreeFileError
from .tree_files import MissingTreeFile, file_name, geometry_digest, read_tree, save_tree


@dataclass
class ObtainedTree:
    """A tree of the core and how it came about.

    timings: seconds; of load_tree if it was in the cache, else of find_tree if it was
    looked for, of build, and of save_tree if it was kept.
    warnings: why a file was not used or not written, a sentence each.
    """

    tree: Any
    timings: dict[str, float] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()


def obtain_tree(
    vertices: npt.NDArray[np.float32],
    faces: npt.NDArray[np.uint32],
    options: Mapping[str, Any],
    cache: str | os.PathLike[str] | None,
) -> ObtainedTree:
    """The tree of a mesh, vertices (V, 3) and faces (F, 3), from a cache if it is there.

    cache: folder of the cache, which is made if need be; None builds. A file that cannot
    be used is replaced, and a cache that cannot be written does no harm, but there are
    warnings of both. A lazy tree is not kept, as it would have to be finished; a tree of
    the fast builder that is there serves in its place. Raises TreeFileError for an empty
    name, which is no folder.
    """
    start = time.perf_counter()
    if cache is None:
        tree = core.KdTree(vertices, faces, **options)
        return ObtainedTree(tree, {"build": time.perf_counter() - start})
    if not os.fspath(cache):
        raise TreeFileError(
            "the name of the folder of the tree cache is empty: '.' is the current folder"
        )
    warnings = []
    loader = core.TreeLoader(vertices, faces)
    geometry = geometry_digest(loader.triangles)
    path = Path(cache) / file_name(geometry, options)
    try:
        tree = read_tree(path, loader, geometry, options)
        return ObtainedTree(tree, {"load_tree": time.perf_counter() - start})
    except MissingTreeFile:
        pass
    except TreeFileError as error:
        warnings.append(f"{error}; the tree is built again")
    del loader
    found = time.perf_counter()
    tree = core.KdTree(vertices, faces, **options)
    built = time.perf_counter()
    timings = {"find_tree": found - start, "build": built - found}
    if not core.tree_is_finished(tree):
        warnings.append(
            f"tree cache '{cache}' does not keep a tree that is built lazily: build it "
            "once with builder = fast, and it is used for both"
        )
        return ObtainedTree(tree, timings, tuple(warnings))
    try:
        make_folder(Path(cache))
        save_tree(tree, path, geometry)
    except TreeFileError as error:
        warnings.append(f"{error}; the tree is not kept for another time")
    timings["save_tree"] = time.perf_counter() - built
    return ObtainedTree(tree, timings, tuple(warnings))


def make_folder(folder: Path) -> None:
    """Makes a folder if it is not there; raises TreeFileError if that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise TreeFileError(
            f"tree cache '{folder}' cannot be made: a file is in its place"
        ) from error
    except OSError as error:
        raise TreeFileError(
            f"tree cache '{folder}' cannot be made: {error.strerror or error}"
        ) from error
