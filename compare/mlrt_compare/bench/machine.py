"""What a figure depends on: the machine, the compiler, the versions."""

from __future__ import annotations

import os
import platform
import re
import subprocess
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mlrt_plugin

from .native import CompiledNative

HUGE_PAGES = Path("/sys/kernel/mm/transparent_hugepage/enabled")
GOVERNOR = Path("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")


def machine_record(source: Path, native: CompiledNative | None) -> dict[str, Any]:
    """As JSON has it; None for what cannot be found out.

    native: if it is measured, what is compiled for benchmarks.
    """
    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": processor(),
        "cores": len(os.sched_getaffinity(0)),
        "governor": first_line(GOVERNOR),
        "memory_bytes": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "huge_pages": first_line(HUGE_PAGES),
        "kernel": f"{platform.system()} {platform.release()}",
        "load": list(os.getloadavg()),
        "isa": mlrt_plugin.isa,
        "compiler": None if native is None else native.compiler,
        "flags": None if native is None else native.flags,
        "python": platform.python_version(),
        "mlrt": mlrt_plugin.__version__,
        "commit": commit(source),
        "mitsuba": version("mitsuba"),
        "drjit": version("drjit"),
    }


def processor() -> str | None:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return None
    match = re.search(r"^model name\s*:\s*(.+)$", text, re.MULTILINE)
    return match[1] if match else None


def first_line(path: Path) -> str | None:
    try:
        return path.read_text().splitlines()[0]
    except (OSError, IndexError):
        return None


def commit(source: Path) -> str | None:
    """The checkout's commit, marked if files differ from it."""

    def git(*arguments: str) -> str:
        return subprocess.run(
            ["git", "-C", str(source), *arguments],
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()

    try:
        changed = git("status", "--porcelain", "--untracked-files=no")
        return git("rev-parse", "HEAD") + (" (changed)" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return None
