"""Mitsuba's llvm_ad_rgb in a process beside, for reference pictures."""

from __future__ import annotations

from collections.abc import Iterator

import mitsuba as mi
import pytest
from mitsuba_worker import MitsubaWorker, Unavailable


@pytest.fixture(autouse=True)
def reading_variant() -> None:
    mi.set_variant("scalar_rgb")


@pytest.fixture(scope="session")
def mitsuba_llvm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MitsubaWorker]:
    """Skips by name where Mitsuba finds no libLLVM."""
    try:
        worker = MitsubaWorker(tmp_path_factory.mktemp("objects"))
    except Unavailable as error:
        pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}")
    yield worker
    worker.close()
