"""The command `mlrt-bench features`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from mlrt_plugin.threads import thread_count

from .checkout import find_checkout
from .errors import BenchError
from .features import measure_features, rows_of
from .figures import new_figures, show, write_json
from .machine import machine_record
from .native import load_native
from .options import default_cache
from .table import aligned, machine_lines

COLUMNS = ("feature that nothing seen has", "CPU ms", "ratio", "quartiles", "same picture")
USUAL = ("office", "cornell-box")


def run(options: argparse.Namespace) -> bool:
    """Returns whether all pictures are those without the features."""
    source = find_checkout(options.source)
    native = load_native(source, options.cache or default_cache())
    figures = new_figures(
        "features",
        machine_record(source, native),
        {
            "spp": options.spp,
            "repeats": options.repeats,
            "resolution": options.resolution,
            "threads": options.threads[0],
        },
    )
    show(machine_lines(figures["machine"]))
    for name in options.scenes or USUAL:
        path = Path(name)
        if not path.suffix:
            path = source / "scenes" / name / f"{name}.xml"
        if not path.is_file():
            raise BenchError(f"scene '{name}' is neither {', '.join(USUAL)} nor a file")
        with thread_count(options.threads[0]):
            times = measure_features(path, options.resolution, options.spp, options.repeats)
        rows = rows_of(times)
        figures["scenes"].append({"name": path.stem, "rows": rows})
        show(["", path.stem, *lines(rows)])
        write_json(options.json, figures)
    return all(row["same_picture"] for s in figures["scenes"] for row in s["rows"])


def lines(rows: list[dict[str, Any]]) -> list[str]:
    table: list[tuple[str, ...]] = [COLUMNS]
    for row in rows:
        first, third = row["quartiles"]
        table.append(
            (
                row["feature"],
                f"{1e3 * row['seconds']:.1f}",
                f"{row['ratio']:.3f}",
                f"{first:.3f} to {third:.3f}",
                "yes" if row["same_picture"] else "no",
            )
        )
    return aligned(table)
