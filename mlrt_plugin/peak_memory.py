"""The most memory that something takes, where the system tells: on Linux."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType

OWN_PROCESS = Path("/proc/self")


class PeakMemory:
    """A context; `bytes` is by how much the memory of this process grew in it at most.

    None where the system does not tell. Memory that was freed before, but not given back
    to the system, is not seen when it is used again.
    """

    def __init__(self) -> None:
        self.bytes: int | None = None
        self._before: int | None = None

    def __enter__(self) -> PeakMemory:
        if forget_peak():
            self._before = resident_bytes("VmRSS")
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._before is not None:
            self.bytes = max(resident_bytes("VmHWM") - self._before, 0)


def resident_bytes(key: str) -> int:
    """`VmRSS`, the memory that is resident, or `VmHWM`, the most since `forget_peak`."""
    for line in (OWN_PROCESS / "status").read_text().splitlines():
        if line.startswith(key + ":"):
            return 1024 * int(line.split()[1])
    raise OSError(f"the system does not tell {key}")


def forget_peak() -> bool:
    """Makes `VmHWM` start from what is resident now, where the system can do that."""
    try:
        (OWN_PROCESS / "clear_refs").write_text("5")
    except OSError:
        return False
    return True
