"""The table of what becomes of Mitsuba's plugins is complete, and the docs hold it."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import pytest
import repository

from mlrt_plugin.coverage import PLUGINS, coverage_rows, coverage_table

IN_PYTHON = {
    "direct_projective",
    "prb",
    "prb_basic",
    "prb_projective",
    "prbvolpath",
    "volprim_rf_basic",
}
"""Plugins that Mitsuba registers from Python have no library of their own."""


def test_every_plugin_has_a_row() -> None:
    folder = Path(str(mi.__file__)).parent / "plugins"
    libraries = {path.stem for path in folder.glob("*.so")}
    assert len(libraries) > 80
    rows = [row.plugin for row in coverage_rows()]
    assert sorted(rows) == sorted(libraries | IN_PYTHON)
    assert {name for names in PLUGINS.values() for name in names} == set(rows)


def test_page_is_up_to_date() -> None:
    page = repository.ROOT / "docs" / "coverage.md"
    if not page.is_file():
        pytest.skip("the documentation is not beside the tests")
    assert page.read_text() == coverage_table()
