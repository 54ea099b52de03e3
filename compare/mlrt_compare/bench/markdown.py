"""Tables of Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    """The first column to the left, the others, which are numbers, to the right."""
    ruler = "|---|" + "--:|" * (len(head) - 1)
    return [row(*head), ruler, *(row(*cells) for cells in rows)]
