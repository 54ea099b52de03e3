"""Figures as text: numbers and aligned columns, for all benchmarks."""

from __future__ import annotations

from typing import Any


def machine_lines(machine: dict[str, Any]) -> list[str]:
    facts = (
        machine["processor"],
        f"{machine['cores']} cores",
        machine["isa"],
        # Of the benchmarks' native side, and of Mitsuba's kernels.
        machine["compiler"] or machine.get("llvm"),
    )
    return [
        ", ".join(str(fact) for fact in facts if fact is not None),
        f"MLRT {machine['mlrt']} at {(machine['commit'] or 'no commit')[:10]}, Mitsuba "
        f"{machine['mitsuba']} with its Embree; load {machine['load'][0]:.1f}",
    ]


def plural(threads: int) -> str:
    return f"{threads} thread{'s' if threads != 1 else ''}"


def number(value: float | None) -> str:
    """Three significant digits, never in powers of ten."""
    if value is None:
        return "-"
    if value == 0:
        return "0"
    digits = 2
    while digits < 7 and abs(value) < 10 ** (2 - digits):
        digits += 1
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.{digits}f}"


def megabytes(count: float) -> str:
    return number(count / 1e6)


def aligned(rows: list[tuple[str, ...]]) -> list[str]:
    """Columns of equal width: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            [row[0].ljust(widths[0])]
            + [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        ).rstrip()
        for row in rows
    ]
