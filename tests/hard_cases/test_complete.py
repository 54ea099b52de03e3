"""None of the forty hard cases is missing."""

from __future__ import annotations

import re
from pathlib import Path


def test_all_forty_cases_are_there() -> None:
    listed = re.compile(r"^@(?:case|covers)\((\d+)\)$", re.MULTILINE)
    found: set[int] = set()
    for path in Path(__file__).parent.glob("*.py"):
        found |= {int(number) for number in listed.findall(path.read_text())}
    assert found == set(range(1, 41))
