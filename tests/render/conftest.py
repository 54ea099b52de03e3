"""Mitsuba in two variants: scalar_rgb here, llvm_ad_rgb in a process beside."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mitsuba as mi
import pytest
from mitsuba_worker import MitsubaWorker, Unavailable


@pytest.fixture(autouse=True)
def scalar_variant() -> None:
    mi.set_variant("scalar_rgb")


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the scenes' mesh files and the reference pictures go."""
    return tmp_path_factory.mktemp("render")


@pytest.fixture(scope="session")
def mitsuba_llvm(folder: Path) -> Iterator[MitsubaWorker]:
    """Skips by name where Mitsuba finds no libLLVM."""
    try:
        worker = MitsubaWorker(folder)
    except Unavailable as error:
        pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}")
    yield worker
    worker.close()
