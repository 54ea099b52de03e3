"""MLRT: primary and shadow rays for Mitsuba 3 scenes by multi-level ray tracing.

Importing the package makes the plugin ``<integrator type="mlrt">`` known to Mitsuba.
"""

from __future__ import annotations

from . import _dispatch, integrator
from .errors import (
    MlrtError,
    MlrtWarning,
    OutputError,
    SceneError,
    TreeFileError,
    UnsupportedFeature,
)
from .image_tiles import ImageTile, image_tiles
from .render import PreparedScene, RenderResult, prepare, render
from .scene_arrays import SceneArrays
from .scene_import import import_scene
from .tree import Hits, KdTree

__version__ = "0.1.0"
__all__ = [
    "Hits",
    "ImageTile",
    "KdTree",
    "MlrtError",
    "MlrtWarning",
    "OutputError",
    "PreparedScene",
    "RenderResult",
    "SceneArrays",
    "SceneError",
    "TreeFileError",
    "UnsupportedFeature",
    "__version__",
    "image_tiles",
    "import_scene",
    "isa",
    "prepare",
    "render",
]

isa: str = _dispatch.core.isa
"""Instruction set of the native core in use."""

integrator.register_everywhere()
