"""The Mitsuba side: its own ``direct`` integrator in llvm_ad_rgb, asked for what MLRT
renders."""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba
import numpy as np
from numpy.typing import NDArray

from mlrt_plugin.hybrid.mitsuba_log import captured_log

from .interrupts import interruptible
from .mitsuba_scene import load_mitsuba_scene
from .settings import Settings

# Mitsuba's type stubs do not know what depends on the variant.
mi: Any = mitsuba

VARIANT = "llvm_ad_rgb"
UNITS = {"ms": 1e-3, "s": 1.0, "m": 60.0, "h": 3600.0}


class MitsubaRenderer:
    """A scene loaded by Mitsuba, to be rendered as often as one likes.

    ``llvm.activate`` comes before the import of this module. Raises SceneError, one
    sentence, if Mitsuba cannot load the scene.
    """

    name = f"Mitsuba {mi.__version__} {VARIANT}"

    def __init__(
        self,
        settings: Settings,
        integrator: Mapping[str, Any] | None = None,
    ) -> None:
        """integrator: what to render, by default that of `load_mitsuba_scene`."""
        mi.set_variant(VARIANT)
        self.llvm = ".".join(map(str, dr.detail.llvm_version()))
        self._settings = settings
        start = time.perf_counter()
        with captured_log(mi.LogLevel.Info) as log:
            loaded = load_mitsuba_scene(settings, VARIANT, integrator)
            dr.sync_thread()
            text = log.read_log()
        seconds = time.perf_counter() - start
        self.build = _build_seconds(text)
        self.load = seconds - (self.build or 0.0)
        self.warnings = [line for line in text.splitlines() if " WARN " in line]
        self.kernels_compiled = self.kernels_from_disk = 0
        self.spp = loaded.spp
        self._loaded = loaded
        self._frames = 0
        self._tensor: Any = None

    def frame(self, *, spp: int | None = None, seed: int | None = None) -> float:
        """Renders a frame and returns the seconds that it took, kernels evaluated.

        spp, seed: in place of those of the settings.
        """
        dr.sync_thread()
        # The history costs time of its own, so only the first frame, which compiles, has
        # it.
        history = dr.scoped_set_flag(dr.JitFlag.KernelHistory, self._frames == 0)
        with interruptible(), history:
            start = time.perf_counter()
            self._tensor = mi.render(
                self._loaded.scene,
                sensor=self._settings.sensor,
                integrator=self._loaded.integrator,
                seed=self._settings.seed if seed is None else seed,
                spp=spp or self.spp,
            )
            dr.eval(self._tensor)
            dr.sync_thread()
            seconds = time.perf_counter() - start
            if self._frames == 0:
                self._count_kernels()
        self._frames += 1
        return seconds

    @property
    def image(self) -> NDArray[np.float32]:
        """The last frame, (H, W, 3) of linear radiance."""
        return np.array(self._tensor, np.float32)

    def _count_kernels(self) -> None:
        for entry in dr.kernel_history([dr.KernelType.JIT]):
            self.kernels_from_disk += bool(entry["cache_disk"])
            self.kernels_compiled += not entry["cache_hit"]


def _build_seconds(log: str) -> float | None:
    """What Mitsuba itself says that Embree's build took; None if it does not say so."""
    found = re.findall(r"Embree ready\. \(took ([\d.e+-]+)(ms|s|m|h)\)", log)
    return sum(float(number) * UNITS[unit] for number, unit in found) if found else None
