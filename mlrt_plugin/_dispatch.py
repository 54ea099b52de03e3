"""Chooses the native core for this processor.

The core is built once an instruction set; ``core`` is the one that was chosen. The
environment variable ``MLRT_ISA`` (``avx2``, ``avx512``, ...) overrides the choice of the
widest.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
from types import ModuleType

import mlrt_llvm

from . import _cpu  # type: ignore[attr-defined]

with mlrt_llvm.offered():
    import drjit  # noqa: F401  (loads the thread pool library that the core is linked to)


def available_isas() -> list[str]:
    """Instruction sets that were built and that this processor has, the widest first."""
    return [
        isa
        for isa in _cpu.supported_isas()
        if importlib.util.find_spec(f"{__package__}._core_{isa}") is not None
    ]


def load_core(isa: str | None = None) -> ModuleType:
    """Returns the core for ``isa``, or the widest that runs here.

    Raises ImportError if ``isa`` is not among :func:`available_isas`, or if there is none.
    """
    available = available_isas()
    if not available:
        raise ImportError(
            "mlrt needs a processor with AVX2 (x86-64-v3); this one supports none of the "
            "instruction sets that the package was built for"
        )
    if isa is None:
        isa = available[0]
    elif isa not in available:
        raise ImportError(
            f"MLRT_ISA={isa!r} is not available here; choose one of: {', '.join(available)}"
        )
    return importlib.import_module(f"{__package__}._core_{isa}")


core: ModuleType = load_core(os.environ.get("MLRT_ISA") or None)
