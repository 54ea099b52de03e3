"""Finds a libLLVM for Mitsuba's llvm variants and hands it to Dr.Jit.

Dr.Jit 1.5 reads ``DRJIT_LIBLLVM_PATH`` once, while ``drjit`` is being imported, and then
takes what it finds: LLVM 14 it refuses, and with LLVM 15 and 16, which know no llvm.minimum
on x86, some of its kernels abort the process. :func:`activate` or :func:`offered` therefore
comes before the first import of drjit or mitsuba, and this package imports neither: it is
none of ``mlrt_plugin``, whose import needs drjit.
"""

from __future__ import annotations

import ctypes
import importlib.metadata
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

VARIABLE = "DRJIT_LIBLLVM_PATH"
MINIMUM_MAJOR = 17
WHEEL = "karellen-llvm-core"
# libLLVM of the wheel needs these, in this order; the loader finds them by their names once
# loaded.
WHEEL_RUNTIME = ("libunwind.so.1", "libc++abi.so.1", "libc++.so.1")
SYSTEM_PATTERNS = (
    "/usr/lib/*-linux-gnu/libLLVM*.so*",
    "/usr/lib/llvm*/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/usr/lib/libLLVM*.so*",
)
REMEDY = (
    f"install one with: pip install 'mlrt[compare]' (and unset {VARIABLE}), "
    f"or set {VARIABLE} to a libLLVM {MINIMUM_MAJOR} or newer"
)
PROBE_SECONDS = 60

# LLVMGetVersion exists since LLVM 16, so a library without it is older.
PROBE = """
import ctypes, sys
for path in sys.argv[2:]:
    ctypes.CDLL(path)
library = ctypes.CDLL(sys.argv[1])
library.LLVMContextCreate
numbers = [ctypes.c_uint() for _ in range(3)]
if hasattr(library, "LLVMGetVersion"):
    library.LLVMGetVersion(*map(ctypes.byref, numbers))
print(*(number.value for number in numbers))
"""


class LlvmUnavailable(RuntimeError):
    """No libLLVM that Dr.Jit can use; the message is one sentence with the remedy."""


@dataclass(frozen=True)
class LibLlvm:
    """A libLLVM that was loaded once in a process of its own and told its version."""

    path: Path
    version: tuple[int, int, int]
    runtime: tuple[Path, ...] = ()
    """Libraries to load before it."""

    @property
    def usable(self) -> bool:
        return self.version[0] >= MINIMUM_MAJOR

    @property
    def name(self) -> str:
        return f"LLVM {'.'.join(map(str, self.version))}"

    def __str__(self) -> str:
        return f"{self.name} ({self.path})"


def probe(path: Path, runtime: tuple[Path, ...] = ()) -> LibLlvm | None:
    """Version of the library at ``path``, (0, 0, 0) if older than 16, None if it is no
    libLLVM.

    A child process loads it: two libLLVMs in one process may clash, and a wrong file may
    crash.
    """
    command = [sys.executable, "-I", "-S", "-c", PROBE, str(path), *map(str, runtime)]
    try:
        child = subprocess.run(
            command, capture_output=True, text=True, timeout=PROBE_SECONDS
        )
    except subprocess.TimeoutExpired:
        return None
    numbers = child.stdout.split()
    if child.returncode != 0 or len(numbers) != 3:
        return None
    major, minor, patch = map(int, numbers)
    return LibLlvm(path, (major, minor, patch), runtime)


def find() -> LibLlvm:
    """The libLLVM to use: the user's variable, else the system's newest, else the wheel's.

    Raises LlvmUnavailable if the user's is not usable, or if there is none at all.
    """
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return _users_choice(Path(chosen))
    too_old: list[str] = []
    for path in _system_libraries():
        library = probe(path)
        if library is not None and library.usable:
            return library
        too_old.append(str(path))
    wheel = _wheel_library()
    probed = probe(wheel.path, wheel.runtime) if wheel is not None else None
    if probed is not None and probed.usable:
        return probed
    found = f" (too old or not loadable: {', '.join(too_old)})" if too_old else ""
    raise LlvmUnavailable(
        f"Mitsuba's llvm_ad_rgb needs libLLVM {MINIMUM_MAJOR} or newer, and there is none "
        f"here{found}; {REMEDY}"
    )


@contextmanager
def offered() -> Iterator[None]:
    """Lets the Dr.Jit that is imported in this context find a libLLVM, if there is one.

    What a variable of the user says goes first, and a Dr.Jit that is there already is left
    alone. Nothing is raised: native rendering needs no libLLVM. The environment is
    restored, as a child process would have to load what the library needs by itself.
    """
    library = None
    if "drjit" not in sys.modules and not os.environ.get(VARIABLE):
        library = _loadable()
    if library is None:
        yield
        return
    os.environ[VARIABLE] = str(library.path)
    try:
        yield
    finally:
        del os.environ[VARIABLE]
    _offers.append(library)


_offers: list[LibLlvm] = []
"""What :func:`offered` has found."""


def activate() -> LibLlvm:
    """Finds a libLLVM and makes the Dr.Jit of this process use it.

    Raises LlvmUnavailable if there is none, or if drjit was imported before and has no
    usable one.
    """
    if "drjit" in sys.modules:
        return _already_loaded()
    library = find()
    # Not RTLD_GLOBAL: the symbols of libunwind and libc++abi would replace those of
    # libstdc++ and libgcc in every library that is loaded later.
    for path in library.runtime:
        ctypes.CDLL(str(path))
    os.environ[VARIABLE] = str(library.path)
    return library


def _loadable() -> LibLlvm | None:
    """The first libLLVM that can be loaded into this process, told by name to be new
    enough."""
    wheel = _wheel_library()
    system = (LibLlvm(path, _version_of_name(path)) for path in _system_libraries())
    for library in (*system, *([wheel] if wheel is not None else [])):
        try:
            for path in (*library.runtime, library.path):
                ctypes.CDLL(str(path))
        except OSError:
            continue
        return library
    return None


def _already_loaded() -> LibLlvm:
    import drjit

    version = (0, 0, 0)
    if drjit.has_backend(drjit.JitBackend.LLVM):
        version = drjit.detail.llvm_version()
    if version[0] >= MINIMUM_MAJOR:
        path = _offers[-1].path if _offers else Path(os.environ.get(VARIABLE, "libLLVM.so"))
        return LibLlvm(path, version)
    usable = find()
    what = f"LLVM {version[0]}" if version[0] > 0 else "no libLLVM"
    raise LlvmUnavailable(
        f"drjit has found {what} in place of {usable}: import mlrt_plugin before the first "
        f"import of drjit and mitsuba, or set {VARIABLE} to that file"
    )


def _users_choice(path: Path) -> LibLlvm:
    library = probe(path)
    if library is None:
        raise LlvmUnavailable(
            f"{VARIABLE}={path} is not a libLLVM that can be loaded; {REMEDY}"
        )
    if not library.usable:
        named = _version_in_name(path)
        version = f"LLVM {named[0]}" if named else f"older than LLVM {MINIMUM_MAJOR}"
        raise LlvmUnavailable(
            f"{VARIABLE}={path} is {version}, and Mitsuba's llvm_ad_rgb needs "
            f"{MINIMUM_MAJOR} or newer; {REMEDY}"
        )
    return library


def _system_libraries() -> Iterator[Path]:
    """Libraries of the system, the newest by name first; those whose name says too old left
    out."""
    found: dict[Path, tuple[int, ...]] = {}
    for pattern in SYSTEM_PATTERNS:
        for path in Path("/").glob(pattern.lstrip("/")):
            real = path.resolve()
            version = _version_in_name(real)
            if version and version[0] >= MINIMUM_MAJOR and real.is_file():
                found[real] = version
    yield from sorted(found, key=lambda path: found[path], reverse=True)


def _version_in_name(path: Path) -> tuple[int, ...] | None:
    """Version in a file name such as libLLVM-14.so.1, libLLVM-18.1.8.so or
    libLLVM.so.19.1."""
    match = re.fullmatch(
        r"libLLVM(?:-(\d+(?:\.\d+)*)\.so(?:\.\d+)*|\.so\.(\d+(?:\.\d+)*))",
        path.resolve().name,
    )
    return tuple(map(int, (match[1] or match[2]).split("."))) if match else None


def _version_of_name(path: Path) -> tuple[int, int, int]:
    major, minor, patch, *_ = (*(_version_in_name(path) or ()), 0, 0, 0)
    return major, minor, patch


def _wheel_library() -> LibLlvm | None:
    """The libLLVM of the wheel, not loaded; its version is that of the distribution."""
    try:
        wheel = importlib.metadata.distribution(WHEEL)
    except importlib.metadata.PackageNotFoundError:
        return None
    # Much quicker than ``wheel.files``, which holds thousands of headers.
    record = wheel.read_text("RECORD") or ""
    files = re.findall(r"^[^,\n]*/lib[^/,\n]*\.so[^,\n]*", record, re.MULTILINE)

    # Symlinks of the wheel appear only when Python first starts in its environment, so the
    # files behind them are taken: libc++.so.1 is a link to libc++.so.1.0.
    def located(start: str) -> Path | None:
        names = sorted(
            Path(str(wheel.locate_file(file))).resolve()
            for file in files
            if file.rpartition("/")[2].startswith(start)
        )
        return next((path for path in names if path.is_file()), None)

    runtime = tuple(path for path in map(located, WHEEL_RUNTIME) if path is not None)
    path = located("libLLVM.so")
    numbers = re.findall(r"\d+", wheel.version)
    if path is None or len(numbers) < 3:
        return None
    return LibLlvm(path, (int(numbers[0]), int(numbers[1]), int(numbers[2])), runtime)
