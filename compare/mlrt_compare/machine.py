"""What the times of a comparison depend on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr

from .bench.checkout import find_checkout
from .bench.errors import BenchError
from .bench.machine import machine_record


def machine_of_comparison() -> dict[str, Any]:
    """As `machine_record`, with Mitsuba's LLVM; the commit is that of the checkout that
    the command runs in, None outside of one."""
    llvm = "LLVM " + ".".join(map(str, dr.detail.llvm_version()))
    try:
        return {**machine_record(find_checkout(None), None), "llvm": llvm}
    except BenchError:
        # The current folder may be in a repository of something else.
        return {**machine_record(Path(), None), "llvm": llvm, "commit": None}
