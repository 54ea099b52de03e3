"""EXR files as arrays, a channel each, and whether two of them can be compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

from .options import CannotRun
from .silence import silenced

COLOUR = ("R", "G", "B")
LUMINANCE = "Y"
MAGIC = b"\x76\x2f\x31\x01"
"""The first bytes of every EXR file."""


@dataclass(frozen=True)
class ExrImage:
    """The channels of an EXR file; those of further parts have the part's name before
    them."""

    path: Path
    channels: dict[str, NDArray[np.float64]]
    """(H, W) each, all of one size."""
    origin: tuple[int, int]
    """Column and row of the data window's first pixel."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        height, width = next(iter(self.channels.values())).shape
        return width, height

    def stack(self, names: Sequence[str]) -> NDArray[np.float64]:
        """(H, W, C) of the channels with these names."""
        return np.stack([self.channels[name] for name in names], axis=-1)


def read_exr(path: Path) -> ExrImage:
    """Reads all channels of a file.

    Raises CannotRun if it is missing, no EXR file, damaged, deep, or subsampled.
    """
    if path.is_dir():
        raise CannotRun(f"{path} is a folder: name an EXR file")
    if not path.is_file():
        raise CannotRun(f"the image {path} does not exist: check its path")
    try:
        with path.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise CannotRun(f"{path} is not an EXR file: convert the image to EXR")
        # Of a damaged part OpenEXR tells the terminal, and leaves it out.
        with silenced():
            declared = len(OpenEXR.File(str(path), header_only=True).parts)
            file = OpenEXR.File(str(path), separate_channels=True)
        if len(file.parts) != declared:
            raise ValueError("its pixels are not whole")
    except (OSError, RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CannotRun(
            f"the EXR file {path} cannot be read and may be damaged: {reason}"
        ) from error
    channels: dict[str, NDArray[np.float64]] = {}
    for part in file.parts:
        if "deep" in str(part.header.get("type", "")).lower():
            raise CannotRun(f"{path} holds deep data: flatten it first")
        prefix = f"{part.name()}." if len(file.parts) > 1 and part.name() else ""
        for name, channel in part.channels.items():
            channels[prefix + name] = np.asarray(channel.pixels, np.float64)
    if not channels:
        raise CannotRun(f"the EXR file {path} has no channel")
    shapes = {plane.shape for plane in channels.values()}
    if len(shapes) > 1 or len(next(iter(shapes))) != 2:
        raise CannotRun(f"the channels of {path} differ in size: write them alike")
    first = file.parts[0].header["dataWindow"][0]
    return ExrImage(path, channels, (int(first[0]), int(first[1])))


def check_comparable(image: ExrImage, reference: ExrImage) -> None:
    """Raises CannotRun for images of different sizes or places."""
    if image.size != reference.size:
        raise CannotRun(
            f"the sizes differ: {image.path} has {size_text(image)} pixels and "
            f"{reference.path} {size_text(reference)}"
        )
    if image.origin != reference.origin:
        raise CannotRun(
            f"the data windows differ: that of {image.path} begins at {image.origin} and "
            f"that of {reference.path} at {reference.origin}"
        )


def common_channels(
    image: ExrImage, reference: ExrImage, wanted: Sequence[str] | None
) -> tuple[str, ...]:
    """The channels to compare: those wanted, or all.

    Raises CannotRun if one of the images lacks one of them.
    """
    names = list(wanted or sorted({*image.channels, *reference.channels}, key=colour_first))
    for one in (image, reference):
        missing = [name for name in names if name not in one.channels]
        if missing:
            raise CannotRun(
                f"{one.path} lacks the channel{'s' * (len(missing) > 1)} "
                f"{', '.join(missing)}: it has {', '.join(one.channels)}; choose what to "
                "compare with --channels"
            )
    return tuple(names)


def colour_first(name: str) -> tuple[int, str]:
    """Sorts R, G and B, in this order, before all others."""
    return (COLOUR.index(name) if name in COLOUR else len(COLOUR), name)


def colour_of(names: Sequence[str]) -> tuple[str, ...]:
    """Which of the channels are the colour: R, G and B, or Y; none if it is not whole."""
    if all(name in names for name in COLOUR):
        return COLOUR
    return (LUMINANCE,) if LUMINANCE in names else ()


def check_finite_reference(reference: ExrImage, names: Sequence[str]) -> None:
    """Raises CannotRun if a value of the reference is nan or infinite."""
    for name in names:
        broken = np.argwhere(~np.isfinite(reference.channels[name]))
        if len(broken):
            row, column = broken[0]
            raise CannotRun(
                f"{len(broken)} values of channel {name} of the reference {reference.path} "
                f"are nan or infinite, the first at column {column}, row {row}: nothing "
                "can be held against it"
            )


def size_text(image: ExrImage) -> str:
    return f"{image.size[0]} x {image.size[1]}"
