"""The variant of Mitsuba that scenes are read in, and where they are written."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import pytest


@pytest.fixture(autouse=True)
def scalar_variant() -> None:
    mi.set_variant("scalar_rgb")


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the scenes' mesh files go."""
    return tmp_path_factory.mktemp("render")
