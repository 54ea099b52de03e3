"""The libLLVM of Mitsuba's llvm variants; see ``mlrt_llvm``."""

from __future__ import annotations

from mlrt_llvm import VARIABLE, LibLlvm, LlvmUnavailable, activate, find

__all__ = ["VARIABLE", "LibLlvm", "LlvmUnavailable", "activate", "find"]
