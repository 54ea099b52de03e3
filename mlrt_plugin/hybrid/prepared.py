"""A scene that Mitsuba shades, with its tree, ready to be rendered any number of times."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import numpy as np

from .. import mitsuba_objects as objects
from ..errors import MlrtError, SceneError, one_sentence, warn_of
from ..integrators import own_aovs
from ..options import BUILD_OPTIONS, TRACE_OPTIONS
from ..render import (
    Progress,
    RenderResult,
    as_depth,
    check_aovs,
    checked_seed,
    chosen_shadow_offset,
)
from ..samplers import checked_spp, own_spp, rounded
from ..scene_arrays import Lighting, same_geometry
from ..scene_import import SceneSummary
from ..shading_choice import ShadingChoice
from ..tree_cache import ObtainedTree, obtain_tree
from ..tree_report import tree_report
from .direct_light import DirectLight, RayHits
from .frame import render_frame
from .hit_scene import HitScene, MeshFaces, mesh_faces, other_shapes
from .loading import MitsubaScene, load_scene
from .samplers import possible_spp


@dataclass(frozen=True)
class PreparedHybrid:
    """The counterpart of `PreparedScene` for scenes that Mitsuba shades."""

    loaded: MitsubaScene
    faces: MeshFaces | None
    tree: Any
    others: Any
    build_options: dict[str, Any]
    timings: dict[str, float]
    shading: ShadingChoice
    hide_emitters: bool
    tree_warnings: tuple[str, ...] = ()

    @property
    def report(self) -> dict[str, Any]:
        """How many shapes are in the tree and how many are left to Mitsuba, and what the
        tree is like, see `tree_report`."""
        shapes = {
            "tree_shapes": self.faces.mesh_count if self.faces is not None else 0,
            "mitsuba_shapes": len(self.others.shapes()) if self.others is not None else 0,
        }
        return {**shapes, **(tree_report(self.tree) if self.tree is not None else {})}

    @property
    def lighting(self) -> Lighting:
        return self.loaded.lighting

    @property
    def spp(self) -> int:
        """Samples per pixel of the scene's sampler."""
        return int(self.loaded.sensor.sampler().sample_count())

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is approximated or ignored, a sentence each."""
        geometry = tuple(self.faces.geometry.warnings) if self.faces is not None else ()
        return self.loaded.warnings + geometry + self.tree_warnings

    def tree_for(self, arrays: Any, build_options: dict[str, Any]) -> Any:
        """The tree if it is that of other vertices and faces too, bit for bit, else
        None."""
        if self.faces is None or build_options != self.build_options:
            return None
        return self.tree if same_geometry(self.faces.geometry, arrays) else None

    def warn(self, stacklevel: int = 1) -> None:
        """Warns of what is approximated or ignored, as if the caller did."""
        warn_of(self.warnings, stacklevel + 1)

    def hits(self, **options: Any) -> HitScene:
        """What answers the rays; `options` are fields of `TraceOptions`."""
        trace = {**self.lighting.own_options(TRACE_OPTIONS), **options}
        return HitScene(self.loaded.shapes, self.tree, self.faces, self.others, trace)

    def light(
        self,
        hits: RayHits,
        emitter_samples: int | None = None,
        bsdf_samples: int | None = None,
    ) -> DirectLight:
        """What computes the radiance on hits of any origin, with as many samples as the
        scene's integrator asks for unless told otherwise."""
        lighting = self.lighting
        depth = lighting.integrator == "depth"
        counts = [
            asked if own is None else own
            for own, asked in (
                (emitter_samples, lighting.emitter_samples),
                (bsdf_samples, lighting.bsdf_samples),
            )
        ]
        return DirectLight(
            self.loaded.module,
            self.loaded.scene,
            hits,
            emitter_samples=0 if depth else counts[0],
            bsdf_samples=0 if depth else counts[1],
            hide_emitters=self.hide_emitters and not depth,
        )

    def render(
        self,
        *,
        spp: int | None = None,
        seed: int = 0,
        aovs: Sequence[str] = (),
        shadow_offset: str | None = None,
        progress: Progress | None = None,
        **options: Any,
    ) -> RenderResult:
        """Renders the scene; `options` are fields of `TraceOptions`. See `render`."""
        check_aovs(aovs)
        if chosen_shadow_offset(self.lighting, shadow_offset) != "mitsuba":
            raise MlrtError(
                "shadow_offset = robust does not exist where Mitsuba shades, which makes "
                "the shadow rays itself: leave it out, or choose shading = native"
            )
        if "cost" in aovs:
            raise MlrtError(
                "aov 'cost' does not exist where Mitsuba shades: leave it out, or choose "
                "shading = native"
            )
        lighting, loaded, sensor = self.lighting, self.loaded, self.loaded.sensor
        sampler = sensor.sampler()
        name = loaded.sampler_name
        asked = own_spp(self.spp, name) if spp is None else checked_spp(spp)
        samples = possible_spp(sampler, asked)
        depth = lighting.integrator == "depth"
        light = self.light(self.hits(**options))
        wanted = list(dict.fromkeys([*aovs, *(["depth"] if depth else own_aovs(lighting))]))
        start = time.perf_counter()
        try:
            with dr.suspend_grad():  # type: ignore[no-untyped-call]
                frame = render_frame(
                    loaded.module,
                    sensor,
                    light,
                    spp=samples,
                    seed=checked_seed(seed, 0),
                    aovs=wanted,
                    progress=progress,
                )
                image, images = frame.image(), frame.aovs()
        except RuntimeError as error:
            first, _, _ = str(error).partition("\n")
            raise SceneError(
                f"Mitsuba's plugins cannot shade the scene: {one_sentence(first)}; find "
                "the one at fault by taking materials, textures and lights out"
            ) from error
        if depth:
            image = as_depth(images["depth"])
            images = {name: images[name] for name in aovs}
        messages = list(self.warnings)
        messages += rounded(objects.plugin_name(sampler), asked, samples)
        broken = int(np.count_nonzero(~np.isfinite(image).all(axis=2)))
        if broken:
            messages.append(
                f"{broken} pixels are not finite: look for textures, materials and lights "
                "with NaN or infinite values"
            )
        return RenderResult(
            image=image,
            aovs=images,
            timings={**self.timings, "render": time.perf_counter() - start},
            counters={},
            warnings=tuple(messages),
        )


def prepare_hybrid(
    scene: Any,
    choice: ShadingChoice,
    *,
    sensor: Any = 0,
    defines: Mapping[str, object] | None = None,
    resolution: tuple[int, int] | None = None,
    hide_emitters: bool | None = None,
    lighting: Lighting | None = None,
    force_direct: bool = False,
    previous: Any = None,
    tree_cache: str | os.PathLike[str] | None = None,
    build: dict[str, Any],
    summary: SceneSummary | None = None,
) -> PreparedHybrid:
    """Loads a scene in Mitsuba and builds a tree of its meshes; arguments as of `prepare`.

    choice: that Mitsuba shades, and why. build: of `BuildOptions`.
    """
    start = time.perf_counter()
    loaded = load_scene(
        scene,
        reason=choice.reason,
        sensor=sensor,
        defines=defines,
        resolution=resolution,
        lighting=lighting,
        force_direct=force_direct,
        summary=summary,
    )
    faces = mesh_faces(loaded.shapes, loaded.names)
    others = other_shapes(loaded.shapes, loaded.groups)
    build = {**loaded.lighting.own_options(BUILD_OPTIONS), **build}
    after = time.perf_counter()
    obtained = ObtainedTree(None)
    if faces is not None:
        tree = previous.tree_for(faces.geometry, build) if previous is not None else None
        if tree is None:
            geometry = faces.geometry
            obtained = obtain_tree(geometry.vertices, geometry.faces, build, tree_cache)
        else:
            obtained = ObtainedTree(tree, {"build": time.perf_counter() - after})
    return PreparedHybrid(
        loaded,
        faces,
        obtained.tree,
        others,
        build,
        {"load": after - start, "build": 0.0, **obtained.timings},
        choice,
        loaded.lighting.hide_emitters if hide_emitters is None else bool(hide_emitters),
        obtained.warnings,
    )
