"""The MLRT side."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import mlrt_plugin
from mlrt_plugin.errors import MlrtError
from mlrt_plugin.integrators import what_is_missing
from mlrt_plugin.parsing import resolving_from
from mlrt_plugin.render import prepare

from .settings import Settings


class MlrtRenderer:
    """A scene loaded by MLRT, to be rendered as often as one likes.

    Raises MlrtError, one sentence, if the scene cannot be rendered.
    """

    name = f"MLRT {mlrt_plugin.__version__} {mlrt_plugin.isa}"

    def __init__(self, settings: Settings) -> None:
        start = time.perf_counter()
        with resolving_from(*settings.folders):
            self._prepared = prepare(
                settings.scene,
                sensor=settings.sensor,
                defines=settings.defines,
                resolution=settings.resolution,
                shading=settings.shading,
                force_direct=True,
            )
        self.build = self._prepared.timings["build"]
        self.load = time.perf_counter() - start - self.build
        self.warnings = self._prepared.warnings
        self.spp = self._prepared.spp if settings.spp is None else settings.spp
        self._seed = settings.seed
        self._image: NDArray[np.float32] | None = None

    @property
    def shading(self) -> str:
        """Who shades, and why."""
        return str(self._prepared.shading)

    @property
    def by_mitsuba(self) -> bool:
        """Whether Mitsuba's plugins shade, the scene's own sampler among them."""
        return self._prepared.shading.path == "mitsuba"

    @property
    def missing(self) -> str:
        """What the scene's integrator computes besides; empty if nothing."""
        return what_is_missing(self._prepared.lighting)

    @property
    def integrator(self) -> dict[str, Any]:
        """The integrator of Mitsuba that takes the same samples."""
        lighting = self._prepared.lighting
        if lighting.integrator == "depth":
            return {"type": "depth"}
        if lighting.emitter_samples == lighting.bsdf_samples == 0:
            return {
                "type": "path",
                "max_depth": 1,
                "hide_emitters": lighting.hide_emitters,
            }
        return {
            "type": "direct",
            "emitter_samples": lighting.emitter_samples,
            "bsdf_samples": lighting.bsdf_samples,
            "hide_emitters": lighting.hide_emitters,
        }

    def frame(self, *, spp: int | None = None, seed: int | None = None) -> float:
        """Renders a frame and returns the seconds that it took.

        spp, seed: in place of those of the settings.
        """
        start = time.perf_counter()
        self._image = self._prepared.render(
            spp=spp or self.spp, seed=self._seed if seed is None else seed
        ).image
        return time.perf_counter() - start

    def cost(self) -> NDArray[np.float32] | None:
        """(H, W) nodes that are visited and triangles that are tested for each pixel; None
        where nobody counts them."""
        try:
            result = self._prepared.render(spp=self.spp, seed=self._seed, aovs=("cost",))
        except MlrtError:
            return None
        return np.asarray(result.aovs["cost"], np.float32)

    @property
    def image(self) -> NDArray[np.float32]:
        """The last frame, (H, W, 3) of linear radiance."""
        if self._image is None:
            self.frame()
        assert self._image is not None
        return self._image
