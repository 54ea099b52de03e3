"""References with variance, by Mitsuba's scalar variant: no LLVM, no code of MLRT."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mitsuba
import numpy as np
from numpy.typing import NDArray

from .exr_files import (
    COLOUR,
    check_comparable,
    check_finite_reference,
    common_channels,
    read_exr,
)
from .mitsuba_scene import load_mitsuba_scene
from .reference_cache import ReferenceCache
from .scene_hash import scene_hash
from .seeds import spread_seeds
from .settings import Settings

mi: Any = mitsuba

VARIANT = "scalar_rgb"
PASSES = 16
"""Renders that a reference is the mean of: between them it can be interrupted; chosen."""
SEEDS = 2**32 + 2
"""Where their seeds start; nothing else starts there."""


@dataclass(frozen=True)
class Reference:
    """Expected values of the pixels."""

    mean: NDArray[np.float64]
    """(H, W, 3) in XYZ."""
    variance: NDArray[np.float64]
    """(H, W, 3), of a single sample, in XYZ."""
    spp: float
    """Samples a pixel; infinite if nobody knows."""
    source: str
    """Where it comes from, in a few words."""


def stored_reference(scene: Path) -> Reference | None:
    """The reference that Mitsuba's own tests keep for a scene: refs/NAME_ref_rgb.exr and
    refs/NAME_ref_rgb_var.exr beside NAME_INTEGRATOR.xml; None if there is none.

    Raises CannotRun for a file that cannot be used.
    """
    name = scene.stem.rpartition("_")[0] or scene.stem
    mean, variance = (
        scene.parent / "refs" / f"{name}_ref_rgb{suffix}.exr" for suffix in ("", "_var")
    )
    if not (mean.is_file() and variance.is_file()):
        return None
    return reference_of_files(mean, variance)


def reference_of_files(mean: Path, variance: Path) -> Reference:
    """The reference of two EXR files, which hold XYZ converted to RGB, as Mitsuba's tests
    write them. Raises CannotRun for files that cannot be used."""
    images = read_exr(mean), read_exr(variance)
    check_comparable(images[1], images[0])
    for image in images:
        common_channels(image, image, COLOUR)
        check_finite_reference(image, COLOUR)
    return Reference(
        to_xyz(images[0].stack(COLOUR)),
        to_xyz(images[1].stack(COLOUR)),
        float("inf"),
        f"{mean}",
    )


def rendered_reference(
    settings: Settings,
    spp: int,
    cache: ReferenceCache,
    *,
    integrator: Mapping[str, Any] | None = None,
    authored: bool = False,
    progress: Callable[[float], object] = lambda share: None,
) -> Reference:
    """Renders a reference of at least ``spp`` samples a pixel, or takes it from the cache.

    integrator: that takes the samples to be judged, by default `direct` with one emitter
    sample. authored: by the integrator that the scene declares instead. Raises SceneError
    if Mitsuba cannot load the scene.
    """
    each = -(-spp // PASSES)
    path = cache.path(
        "scalar reference",
        version("mitsuba"),
        scene_hash(settings),
        each,
        "authored" if authored else sorted((integrator or {}).items()),
    )
    arrays = cache.load(path)
    if arrays is None or set(arrays) != {"mean", "variance"}:
        arrays = _rendered(settings, each, integrator, authored, progress)
        cache.store(path, arrays)
    return Reference(
        arrays["mean"], arrays["variance"], each * PASSES, f"Mitsuba {VARIANT}"
    )


def _rendered(
    settings: Settings,
    spp: int,
    integrator: Mapping[str, Any] | None,
    authored: bool,
    progress: Callable[[float], object],
) -> dict[str, NDArray[np.float64]]:
    loaded = load_mitsuba_scene(settings, VARIANT, integrator)
    nested = loaded.scene.integrator() if authored else loaded.integrator
    moment = mi.load_dict({"type": "moment", "nested": nested})
    images = []
    for number, seed in enumerate(spread_seeds(SEEDS, PASSES)):
        progress(number / PASSES)
        image = mi.render(
            loaded.scene,
            sensor=settings.sensor,
            integrator=moment,
            spp=spp,
            seed=seed,
        )
        images.append(np.array(image, np.float64))
    progress(1.0)
    # Colour, mean and second moment; the latter two in XYZ.
    mean, second = np.split(np.mean(images, axis=0)[..., 3:], 2, axis=-1)
    return {"mean": mean, "variance": np.maximum(second - mean**2, 0.0)}


def to_xyz(rgb: NDArray[np.floating]) -> NDArray[np.float64]:
    """CIE XYZ of linear RGB with the primaries of sRGB, (H, W, 3), as Mitsuba has it."""
    mi.set_variant(mi.variant() or VARIANT)
    bitmap = mi.Bitmap(np.ascontiguousarray(rgb, np.float32), mi.Bitmap.PixelFormat.RGB)
    return np.array(
        bitmap.convert(mi.Bitmap.PixelFormat.XYZ, mi.Struct.Type.Float32, False), np.float64
    )
