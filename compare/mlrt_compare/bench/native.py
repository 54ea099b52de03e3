"""The native side of benchmarks: both engines in one module, compiled when first needed."""

from __future__ import annotations

import fcntl
import hashlib
import importlib.machinery
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import mlrt_plugin

from .errors import BenchError

SOURCE_FOLDERS = ("cpp", "compare/benchmarks")
SOURCE_SUFFIXES = (".h", ".cpp", ".cmake", ".txt")
EXACT, INEXACT, WATERTIGHT = "_bench", "_bench_inexact", "_bench_watertight"
"""Modules: with the core as it is, with one that trusts single precision, and with one that
trusts it in distances, but not in what is hit."""
PACKAGES = ("nanobind", "drjit", "mitsuba")
"""Whose headers and libraries the module is compiled with."""
REMEDY = "install what benchmarks need with pip install 'mlrt[bench]'"


@dataclass(frozen=True)
class CompiledNative:
    """The module as a file, and what made it."""

    library: Path
    compiler: str
    """The compiler's name and version."""
    flags: str
    """What code generation depends on: -O, -m, -f and -std options."""


@dataclass(frozen=True)
class Native(CompiledNative):
    """The same, loaded."""

    module: ModuleType


@dataclass(frozen=True)
class Tools:
    cmake: str
    ninja: str
    compiler: str

    def compiler_version(self) -> str:
        try:
            output = subprocess.run(
                [self.compiler, "--version"], capture_output=True, text=True, check=True
            ).stdout
        except (OSError, subprocess.CalledProcessError) as error:
            raise BenchError(
                f"the C++ compiler {self.compiler} cannot be run: repair it or name "
                "another in the environment variable CXX"
            ) from error
        return output.splitlines()[0].strip()


def find_tools() -> Tools:
    """Raises BenchError for what is missing."""
    # The wheels' commands are beside the interpreter, be its environment activated or not.
    folders = os.pathsep.join(
        [str(Path(sys.executable).parent), os.environ.get("PATH", "")]
    )
    found = {}
    for name in ("cmake", "ninja"):
        path = shutil.which(name, path=folders)
        if path is None:
            raise BenchError(f"the command {name} is missing: {REMEDY}")
        found[name] = path
    for package in PACKAGES:
        if importlib.util.find_spec(package) is None:
            raise BenchError(f"the package {package} is missing: {REMEDY}")
    wanted = os.environ.get("CXX") or "c++"
    compiler = shutil.which(wanted)
    if compiler is None:
        raise BenchError(
            f"there is no C++ compiler '{wanted}': install one or name another in the "
            "environment variable CXX"
        )
    return Tools(found["cmake"], found["ninja"], compiler)


def source_files(source: Path) -> Iterator[Path]:
    for folder in SOURCE_FOLDERS:
        for path in sorted((source / folder).rglob("*")):
            if path.suffix in SOURCE_SUFFIXES and path.is_file():
                yield path


def key_of(source: Path, isa: str, compiler: str) -> str:
    """Names what the module depends on: equal keys, equal modules."""
    digest = hashlib.sha256()
    facts = [isa, compiler, sys.version, os.environ.get("CXXFLAGS", "")]
    facts += [f"{package} {version(package)}" for package in PACKAGES]
    # Where the libraries are that the module is linked to.
    facts += [str(origin_of(package)) for package in PACKAGES]
    digest.update("\0".join(facts).encode())
    for path in source_files(source):
        digest.update(f"\0{path.relative_to(source)}\0".encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def origin_of(package: str) -> str | None:
    spec = importlib.util.find_spec(package)
    return None if spec is None else spec.origin


def load_native(source: Path, cache: Path, module: str = EXACT) -> Native:
    """The module for the instruction set that `mlrt_plugin` chose, from ``cache`` if it was
    compiled before. Raises BenchError if it cannot be compiled."""
    compiled = compiled_native(source, cache, module)
    return Native(**vars(compiled), module=loaded(compiled.library))


def compiled_native(source: Path, cache: Path, module: str = EXACT) -> CompiledNative:
    """The same without loading it, for other processes to do so."""
    tools = find_tools()
    compiler = tools.compiler_version()
    folder = cache / "native" / key_of(source, mlrt_plugin.isa, compiler)
    suffix = importlib.machinery.EXTENSION_SUFFIXES[0]
    library, flags = folder / f"{module}{suffix}", folder / "flags.txt"
    if not library.is_file():
        compile_native(source, cache, tools, library, flags)
    return CompiledNative(library, compiler, flags.read_text().strip())


def loaded(library: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(module_name(library), library)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def module_name(library: Path) -> str:
    return library.name.partition(".")[0]


def compile_native(
    source: Path, cache: Path, tools: Tools, library: Path, flags: Path
) -> None:
    isa = mlrt_plugin.isa
    # One build folder serves all states of a checkout, so that a change compiles quickly.
    place = hashlib.sha256(f"{source}\0{sys.prefix}\0{isa}".encode()).hexdigest()[:16]
    build = cache / "native" / f"build-{place}"
    build.mkdir(parents=True, exist_ok=True)
    print(f"mlrt-bench: compiling for {isa}, about a minute", file=sys.stderr, flush=True)
    with locked(build / "lock"):
        log = build / "log.txt"
        settings = {
            "CMAKE_BUILD_TYPE": "Release",
            "CMAKE_MAKE_PROGRAM": tools.ninja,
            "CMAKE_CXX_COMPILER": tools.compiler,
            "CMAKE_EXPORT_COMPILE_COMMANDS": "ON",
            "Python_EXECUTABLE": sys.executable,
            "MLRT_BENCH_ISA": isa,
        }
        folders = ["-S", source / "compare/benchmarks", "-B", build, "-G", "Ninja"]
        values = [f"-D{name}={value}" for name, value in settings.items()]
        configure = [tools.cmake, *folders, *values]
        with log.open("w") as output:
            make = [tools.cmake, "--build", build, "--target", module_name(library)]
            for command in (configure, make):
                code = subprocess.run(
                    list(map(str, command)), stdout=output, stderr=subprocess.STDOUT
                ).returncode
                if code != 0:
                    raise BenchError(
                        f"the native side of the benchmarks does not compile: see {log}"
                    )
        library.parent.mkdir(exist_ok=True)
        flags.write_text(flags_of(build) + "\n")
        partial = library.with_name(f".{library.name}.{os.getpid()}")
        try:
            shutil.copyfile(build / library.name, partial)
            partial.replace(library)
        finally:
            partial.unlink(missing_ok=True)


def flags_of(build: Path) -> str:
    commands = json.loads((build / "compile_commands.json").read_text())
    command = next(c["command"] for c in commands if c["file"].endswith("mlrta/trace.cpp"))
    kept = [word for word in command.split() if word.startswith(("-O", "-m", "-f", "-std"))]
    return " ".join(dict.fromkeys(kept))


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Keeps other processes out that want the same lock; it goes with the process."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
