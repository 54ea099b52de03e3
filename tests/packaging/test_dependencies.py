"""Folders depend on each other in one direction, and third parties have one way in."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import repository

CPP_ORDER = ["base", "geometry", "kdtree", "traverse", "mlrta", "objects", "render", "bind"]
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)

# What only the vocabulary of vector code may name.
VECTOR_CODE = re.compile(r"\bdrjit::|\b_mm\d*_|\b__m\d+")

# Third party: the files that alone may include it, and do.
ENTRIES = {
    "drjit/": ["base/simd.h", "base/morton.h"],
    "nanothread/": ["base/parallel.cpp"],
}


def include_faults(file: str, text: str) -> list[str]:
    """Returns what is wrong with the includes of a file, named relative to cpp/."""
    faults = []
    folder = file.split("/")[0]
    for quote, target in INCLUDE.findall(text):
        if quote == '"':
            other = target.split("/")[0]
            if other not in CPP_ORDER:
                faults.append(f"{file} includes {target} without its folder")
            elif CPP_ORDER.index(other) > CPP_ORDER.index(folder):
                faults.append(f"{file} includes {target} from further up")
        for library, entries in ENTRIES.items():
            if target.startswith(library) and file not in entries:
                faults.append(f"{file} includes {target}")
        if target.startswith(("nanobind/", "Python.h")) and folder != "bind":
            faults.append(f"{file} knows Python through {target}")
    if folder != "base" and (name := VECTOR_CODE.search(text)):
        faults.append(f"{file} has {name[0]}, which is for cpp/base")
    return faults


# Package or folder: what it may never import.
FORBIDDEN_IMPORTS = {
    "mlrt_files": ["drjit", "mitsuba", "mlrt_llvm", "mlrt_plugin", "mlrt_compare", "tests"],
    "mlrt_llvm": ["mitsuba", "mlrt_plugin", "mlrt_compare", "tests", "pytest"],
    "mlrt_plugin": ["mlrt_compare", "tests", "oracles", "workloads", "pytest"],
    "compare": [
        "tests",
        "oracles",
        "workloads",
        "pytest",
        "mlrt_plugin._core",
        "mlrt_plugin._cpu",
    ],
}


def imported_modules(text: str, package: str) -> Iterator[str]:
    """Yields the full names that a module of ``package`` imports, anywhere in it."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            prefix = ".".join(filter(None, (package if node.level else "", node.module)))
            yield prefix
            yield from (f"{prefix}.{alias.name}" for alias in node.names)


def import_faults(file: str, text: str) -> list[str]:
    """Returns the forbidden imports of a Python file."""
    folder = file.split("/")[0]
    package = Path(file).parent.name
    return [
        f"{file} imports {module}"
        for module in imported_modules(text, package)
        for name in FORBIDDEN_IMPORTS[folder]
        if module == name or module.startswith((f"{name}.", f"{name}_"))
    ]


def test_includes_point_down_only() -> None:
    files = repository.tracked_files("cpp/*.h", "cpp/*.cpp")
    assert len(files) > 10
    faults = []
    for file in files:
        text = (repository.ROOT / file).read_text()
        faults += include_faults(file.relative_to("cpp").as_posix(), text)
    assert not faults


def test_every_header_is_included() -> None:
    files = repository.tracked_files("cpp/*.h", "cpp/*.cpp", "compare/benchmarks/*.cpp")
    texts = {file: (repository.ROOT / file).read_text() for file in files}
    included = {target for text in texts.values() for _, target in INCLUDE.findall(text)}
    headers = {f.relative_to("cpp").as_posix() for f in files if f.suffix == ".h"}
    assert headers
    assert not headers - included


def test_third_parties_come_in_where_they_should() -> None:
    for library, entries in ENTRIES.items():
        for entry in entries:
            text = (repository.ROOT / "cpp" / entry).read_text()
            targets = [target for _, target in INCLUDE.findall(text)]
            assert any(target.startswith(library) for target in targets)


def test_imports_point_down_only() -> None:
    files = repository.tracked_files(
        "mlrt_files/*.py", "mlrt_llvm/*.py", "mlrt_plugin/*.py", "compare/*.py"
    )
    assert len(files) > 2
    faults = []
    for file in files:
        faults += import_faults(file.as_posix(), (repository.ROOT / file).read_text())
    assert not faults


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("geometry/a.h", '#include "kdtree/node.h"'),
        ("base/a.h", '#  include "bind/bind.h"'),
        ("traverse/a.h", "#include <drjit/packet.h>"),
        ("base/a.cpp", "#include <nanothread/nanothread.h>"),
        ("render/a.cpp", "#include <nanobind/nanobind.h>"),
        ("mlrta/a.cpp", "#include <Python.h>"),
        ("base/a.h", '#include "vec.h"'),
        ("kdtree/a.h", "#include <drjit/array.h>"),
        ("mlrta/a.h", "return drjit::all(a);"),
        ("traverse/a.cpp", "const auto a = _mm512_setzero_ps();"),
        ("geometry/a.h", "__m256 a;"),
    ],
)
def test_wrong_includes_are_found(file: str, text: str) -> None:
    assert len(include_faults(file, text)) == 1


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("mlrt_plugin/a.py", "def f():\n    import mlrt_compare.metrics"),
        ("mlrt_plugin/a.py", "from mlrt_compare import metrics"),
        ("compare/mlrt_compare/a.py", "from mlrt_plugin._core_avx2 import KdTree"),
        ("compare/mlrt_compare/a.py", "import oracles"),
    ],
)
def test_wrong_imports_are_found(file: str, text: str) -> None:
    assert import_faults(file, text)


def test_right_imports_pass() -> None:
    assert not import_faults("mlrt_plugin/a.py", "from . import errors\nimport numpy")
    assert not import_faults(
        "compare/mlrt_compare/a.py", "import mlrt_plugin\nfrom . import run"
    )
    assert not include_faults("mlrta/a.cpp", '#include "base/vec.h"\n#include <vector>')
