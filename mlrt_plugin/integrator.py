"""The plugin ``<integrator type="mlrt">``.

It is known to Mitsuba as soon as this package is imported, in the variant that is set and
in all that are set later. Its parameters are `hide_emitters`, `emitter_samples` and
`bsdf_samples` as of `direct`, by default 1 and 0; `shading`; `shadow_offset`; and the
options of building and tracing in `mlrt_plugin.options.INTEGRATOR_OPTIONS`, which change
the time that is taken, never the image.
"""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt

from .errors import warn_of
from .options import INTEGRATOR_OPTIONS
from .render import Prepared, prepare
from .scene_arrays import Lighting
from .shading_choice import checked_shading

mitsuba: Any = mi
"""For what Mitsuba's type stubs leave out."""

PLUGIN = "mlrt"
SAMPLE_COUNTS = {"emitter_samples": 1, "bsdf_samples": 0}
"""Parameters of `direct` that the plugin also takes, with its defaults."""

_registered: set[str] = set()


def integrator_class(module: Any) -> type:
    """The integrator for a variant; Mitsuba's classes differ from variant to variant."""

    class MlrtIntegrator(module.SamplingIntegrator):  # type: ignore[misc]
        """Direct illumination by multi-level ray tracing on the CPU, in RGB variants."""

        def __init__(self, props: Any) -> None:
            # Mitsuba warns of slow Python in scalar variants, but this is native.
            level = mitsuba.log_level()
            mitsuba.set_log_level(mi.LogLevel.Error)
            try:
                super().__init__(props)
            finally:
                mitsuba.set_log_level(level)
            self.sample_counts = {
                name: int(props.get(name, count)) for name, count in SAMPLE_COUNTS.items()
            }
            if "shading" in props:
                checked_shading(props["shading"])
            self.mlrt_parameters = {
                name: props.get(name)
                for name in (
                    "shading",
                    "shadow_offset",
                    *SAMPLE_COUNTS,
                    *INTEGRATOR_OPTIONS,
                )
                if name in props
            }
            self.prepared: Prepared | None = None

        def class_name(self) -> str:
            return "MlrtIntegrator"

        def to_string(self) -> str:
            return f"MlrtIntegrator[{self.mlrt_parameters}]"

        def render(
            self,
            scene: Any,
            sensor: Any = 0,
            seed: Any = 0,
            spp: int = 0,
            develop: bool = True,
            evaluate: bool = True,
        ) -> Any:
            """Renders natively, or by Mitsuba's plugins where the scene needs them.

            The tree is kept for the next image of the same meshes."""
            self.prepared = prepare(
                scene,
                sensor=sensor,
                lighting=Lighting(
                    PLUGIN,
                    **self.sample_counts,
                    hide_emitters=self.hide_emitters,
                    parameters=self.mlrt_parameters,
                ),
                previous=self.prepared,
            )
            self.prepared.warn(stacklevel=2)
            result = self.prepared.render(
                spp=spp or None, seed=int(np.asarray(seed).reshape(-1)[0])
            )
            warn_of((m for m in result.warnings if m not in self.prepared.warnings), 2)
            if not isinstance(sensor, mi.Object):
                sensor = scene.sensors()[sensor]
            fill_film(module, sensor.film(), result.image)
            return module.TensorXf(result.image) if develop else module.TensorXf()

    return MlrtIntegrator


def fill_film(module: Any, film: Any, image: npt.NDArray[np.float32]) -> None:
    """Leaves an image (H, W, 3) in the film, where Mitsuba's integrators leave theirs.

    The film divides by the weight, its last channel, which is 1; so is alpha, if the film
    has it.
    """
    channels = int(film.prepare([]))
    values = np.ones((*image.shape[:2], channels), np.float32)
    values[..., :3] = image
    film.put_block(
        module.ImageBlock(module.TensorXf(values), offset=film.crop_offset(), border=False)
    )


def register(variant: str | None) -> None:
    """Makes the plugin known in a variant, once."""
    if variant is None or variant in _registered:
        return
    module = getattr(mi, variant)
    module.register_integrator(PLUGIN, integrator_class(module))
    _registered.add(variant)


def register_everywhere() -> None:
    """Makes the plugin known in the variant that is set, and in those that will be."""
    register(mi.variant())
    mitsuba.detail.add_variant_callback(_variant_changed)


def _variant_changed(before: str | None, after: str | None) -> None:
    register(after)
