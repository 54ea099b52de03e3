"""Which libLLVM is taken, and that those which would abort the process are refused."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mlrt_llvm as llvm

COMPILER = shutil.which("c++") or shutil.which("g++") or shutil.which("clang++")


def fake_llvm(folder: Path, name: str, version: int | None) -> Path:
    """A library that answers like libLLVM ``version``; None: as before LLVMGetVersion
    existed."""
    if COMPILER is None:
        pytest.skip("no C++ compiler to build a stand-in for libLLVM")
    source = 'extern "C" void LLVMContextCreate() {}\n'
    if version is not None:
        source += (
            'extern "C" void LLVMGetVersion(unsigned *a, unsigned *b, unsigned *c)'
            f"{{ *a = {version}; *b = 1; *c = 2; }}\n"
        )
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [COMPILER, "-shared", "-fPIC", "-x", "c++", "-", "-o", str(path)],
        input=source,
        text=True,
        check=True,
    )
    return path


@pytest.fixture(autouse=True)
def bare_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """No variable set, no wheel, and a system folder that is empty until a test fills
    it."""
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setattr(llvm, "SYSTEM_PATTERNS", (f"{tmp_path}/system/libLLVM*.so*",))
    monkeypatch.setattr(llvm, "WHEEL", "no-distribution-of-this-name")
    return tmp_path


def test_none_at_all_is_one_sentence_with_the_remedy() -> None:
    with pytest.raises(llvm.LlvmUnavailable) as caught:
        llvm.find()
    message = str(caught.value)
    assert "pip install 'mlrt[compare]'" in message and llvm.VARIABLE in message
    assert "\n" not in message


def test_version_is_read_from_the_library(tmp_path: Path) -> None:
    library = llvm.probe(fake_llvm(tmp_path, "libLLVM.so", 18))
    assert library is not None
    assert library.version == (18, 1, 2) and library.usable


@pytest.mark.parametrize(
    ("name", "version", "said"),
    [
        ("libLLVM-14.so.1", None, "is LLVM 14"),
        ("libLLVM-15.so.1", None, "is LLVM 15"),
        ("libLLVM-16.so.1", 16, "is LLVM 16"),
        ("libLLVM.so", None, "is older than LLVM 17"),
        ("libLLVM.so", 15, "is older than LLVM 17"),
    ],
)
def test_users_library_that_is_too_old_is_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    version: int | None,
    said: str,
) -> None:
    # A newer one of the system must not silently replace what the user asked for.
    fake_llvm(tmp_path, "system/libLLVM.so.20.1", 20)
    monkeypatch.setenv(llvm.VARIABLE, str(fake_llvm(tmp_path, name, version)))
    with pytest.raises(llvm.LlvmUnavailable, match=said):
        llvm.find()


def test_users_variable_that_names_no_library_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = tmp_path / "libLLVM.so"
    text.write_text("not a library")
    for path in (text, tmp_path / "missing.so"):
        monkeypatch.setenv(llvm.VARIABLE, str(path))
        with pytest.raises(
            llvm.LlvmUnavailable, match="is not a libLLVM that can be loaded"
        ):
            llvm.find()


def test_users_library_comes_before_the_systems(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fake_llvm(tmp_path, "system/libLLVM.so.20.1", 20)
    own = fake_llvm(tmp_path, "own.so", 17)
    monkeypatch.setenv(llvm.VARIABLE, str(own))
    assert llvm.find().path == own


def test_systems_newest_is_taken_and_old_ones_are_passed_over(tmp_path: Path) -> None:
    fake_llvm(tmp_path, "system/libLLVM-15.so.1", None)
    fake_llvm(tmp_path, "system/libLLVM-16.so.1", 16)
    fake_llvm(tmp_path, "system/libLLVM.so.18.1", 18)
    newest = fake_llvm(tmp_path, "system/libLLVM-20.so.1", 20)
    assert llvm.find().path == newest


def test_library_whose_name_lies_is_refused(tmp_path: Path) -> None:
    fake_llvm(tmp_path, "system/libLLVM.so.20.1", None)
    with pytest.raises(llvm.LlvmUnavailable, match=r"too old or not loadable: .*20\.1"):
        llvm.find()


def test_wheel_is_the_last_resort(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.undo()
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setattr(llvm, "SYSTEM_PATTERNS", ())
    library = llvm.find()
    assert library.usable
    assert library.runtime, "libc++ of the wheel must be loaded before its libLLVM"


def test_activation_reaches_drjit() -> None:
    program = """
import mlrt_llvm as llvm
chosen = llvm.activate()
import drjit
assert drjit.has_backend(drjit.JitBackend.LLVM)
assert drjit.detail.llvm_version() == chosen.version, drjit.detail.llvm_version()
"""
    subprocess.run([sys.executable, "-P", "-c", program], check=True, timeout=120)


def test_too_late_is_said_when_drjit_has_no_usable_llvm(tmp_path: Path) -> None:
    program = """
import drjit
import mlrt_llvm as llvm
llvm.find = lambda: llvm.LibLlvm("libLLVM.so.20", (20, 1, 0))
drjit.detail.llvm_version = lambda: (15, 0, 7)
try:
    llvm.activate()
except llvm.LlvmUnavailable as error:
    assert "before the first import" in str(error), error
else:
    raise SystemExit("a libLLVM that aborts the process was accepted")
"""
    subprocess.run([sys.executable, "-P", "-c", program], check=True, timeout=120)
