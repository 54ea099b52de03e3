"""The variant of Mitsuba that scenes are read in."""

from __future__ import annotations

import mitsuba as mi
import pytest


@pytest.fixture(autouse=True)
def reading_variant() -> None:
    mi.set_variant("scalar_rgb")
