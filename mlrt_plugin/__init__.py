"""MLRT: primary and shadow rays for Mitsuba 3 scenes by multi-level ray tracing."""

from __future__ import annotations

from . import _dispatch

__version__ = "0.1.0"
__all__ = ["__version__", "isa"]

isa: str = _dispatch.core.isa
"""Instruction set of the native core in use."""
