"""Mitsuba's llvm_ad_rgb, in this process; tests are skipped by name where it has no
libLLVM."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import mitsuba as mi
import plugin_assets
import pytest

import mlrt_llvm


@pytest.fixture(autouse=True)
def llvm_variant() -> Iterator[None]:
    """Other tests find the variant that they know."""
    try:
        mlrt_llvm.activate()
    except mlrt_llvm.LlvmUnavailable as error:
        pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}")
    mi.set_variant("llvm_ad_rgb")
    yield
    mi.set_variant("scalar_rgb")


@pytest.fixture(scope="session")
def assets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files that the scenes refer to."""
    mi.set_variant("scalar_rgb")
    folder = tmp_path_factory.mktemp("assets")
    plugin_assets.write_assets(folder)
    return folder
