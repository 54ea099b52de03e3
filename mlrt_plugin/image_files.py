"""Writes images: whole, or not at all.

An EXR file holds the channels R, G, B and one channel for each number of an AOV, in single
precision, named as Mitsuba's `aov` integrator names them: ``depth.T``, ``normal.X``,
``normal.Y``, ``normal.Z`` and ``prim.I``; the moments as its `moment` names those of an
integrator `direct`, ``direct.X`` to ``m2_direct.Z``. A PNG file holds 8-bit sRGB.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import OpenEXR

from mlrt_files import obstacle, replacing

from .errors import OutputError

FORMATS = (".exr", ".png")
CHANNELS = {"depth": ("depth.T",), "normal": ("normal.X", "normal.Y", "normal.Z")}
CHANNELS |= {"prim": ("prim.I",), "cost": ("cost.Y",)}
CHANNELS["moment"] = tuple(
    f"{name}.{axis}" for name in ("direct", "m2_direct") for axis in "XYZ"
)


def check_output(path: Path, aovs: tuple[str, ...] = ()) -> None:
    """Raises OutputError if an image with such AOVs cannot be written there."""
    if path.suffix.lower() not in FORMATS:
        raise OutputError(
            f"output '{path}' has no known format: let its name end in "
            f"{' or '.join(FORMATS)}"
        )
    if aovs and path.suffix.lower() != ".exr":
        raise OutputError(f"output '{path}' cannot hold AOVs: let its name end in .exr")
    if found := obstacle(path):
        raise OutputError(f"output '{path}' cannot be written: {found}")


def write_image(
    path: Path,
    image: npt.NDArray[np.float32],
    aovs: Mapping[str, npt.NDArray[Any]] | None = None,
) -> None:
    """Writes linear RGB (H, W, 3) and AOVs (H, W) or (H, W, C), by the file's suffix.

    Raises OutputError if that is not possible; the file is then as it was before.
    """
    check_output(path, tuple(aovs or ()))
    try:
        with replacing(path) as temporary:
            if path.suffix.lower() == ".exr":
                write_exr(temporary, image, aovs or {})
            else:
                write_png(temporary, image)
    except (OSError, RuntimeError) as error:
        known = error.strerror if isinstance(error, OSError) else None
        reason = known or " ".join(str(error).split())
        raise OutputError(f"output '{path}' cannot be written: {reason}") from error


def write_exr(
    path: Path, image: npt.NDArray[np.float32], aovs: Mapping[str, npt.NDArray[Any]]
) -> None:
    planes = dict(zip("RGB", np.moveaxis(image, 2, 0), strict=True))
    for name, values in aovs.items():
        stack = np.moveaxis(np.atleast_3d(values), 2, 0)
        planes.update(zip(CHANNELS[name], stack, strict=True))
    channels = {name: np.ascontiguousarray(p, np.float32) for name, p in planes.items()}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(str(path))


def write_png(path: Path, image: npt.NDArray[np.float32]) -> None:
    bitmap = mi.Bitmap(np.ascontiguousarray(image, np.float32))
    bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True).write(str(path))
