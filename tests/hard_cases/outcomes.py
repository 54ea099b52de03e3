"""A plugin of pytest that tells what came of each hard case."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

CASE = "hard_case"


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--outcomes", type=Path, help="write outcomes by case there, as JSON")
    parser.addoption("--only-core", help="leave out tests of other cores than this one")


def case_of(item: pytest.Item) -> int | None:
    """The number of the case that a test is of."""
    listed = getattr(item, "callspec", None) and item.callspec.params.get("listed")  # type: ignore[attr-defined]
    if listed:
        return int(listed.number)
    return getattr(getattr(item, "function", None), CASE, None)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    wanted = config.getoption("--only-core")
    others = [
        item
        for item in items
        if hasattr(item, "callspec")
        and (core := item.callspec.params.get("core"))
        and core.isa != wanted
    ]
    config.hook.pytest_deselected(items=others)
    items[:] = [item for item in items if item not in others]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[Any]
) -> Iterator[None]:
    report = yield
    report.user_properties.append((CASE, case_of(item)))
    return report  # type: ignore[return-value]


class Outcomes:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.by_case: dict[int, dict[str, Any]] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        number = dict(report.user_properties).get(CASE)
        if number is None or (report.passed and report.when != "call"):
            return
        case = self.by_case.setdefault(
            number, {"passed": 0, "failed": 0, "skipped": 0, "reasons": []}
        )
        case[report.outcome] += 1
        if report.skipped and isinstance(report.longrepr, tuple):
            case["reasons"].append(report.longrepr[2].removeprefix("Skipped: "))

    def pytest_sessionfinish(self) -> None:
        self.path.write_text(json.dumps(self.by_case))


def pytest_configure(config: pytest.Config) -> None:
    path = config.getoption("--outcomes")
    if path is not None:
        config.pluginmanager.register(Outcomes(path))
