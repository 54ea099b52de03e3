"""Direct illumination by Mitsuba's plugins, as its integrator `direct` defines it.

The order of the random numbers is that of `direct`, so that the same sampler gives the same
image; the source of the formulas is `direct.cpp` of Mitsuba 3.9.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr
import mitsuba as mi

mitsuba: Any = mi
"""For what Mitsuba's type stubs leave out."""


class RayHits(Protocol):
    """What answers rays of Mitsuba's type, a wavefront at a time, see `HitScene`."""

    def closest_hit(self, ray: Any, active: Any) -> tuple[Any, Any]: ...

    def any_hit(self, ray: Any, active: Any) -> Any: ...


@dataclass(frozen=True)
class PrimaryHits:
    """What the rays of the camera see first.

    interaction: SurfaceInteraction3f. face: Int32, number of the face among all meshes, -1
    for a miss or a shape that is no mesh.
    """

    interaction: Any
    face: Any


class DirectLight:
    """Radiance along rays, from emitter samples and BSDF samples."""

    def __init__(
        self,
        module: Any,
        scene: Any,
        hits: RayHits,
        *,
        emitter_samples: int,
        bsdf_samples: int,
        hide_emitters: bool,
    ) -> None:
        """module: of the scene's variant. Without samples only hits are of interest."""
        self._module = module
        self._scene = scene
        self._hits = hits
        self._emitter_samples = emitter_samples
        self._bsdf_samples = bsdf_samples
        self._hide_emitters = hide_emitters
        # Rays find the lights that have a place or are all around; others cannot be hit.
        self._lights_can_be_hit = any(
            emitter.is_environment()
            or module.has_flag(emitter.flags(), mi.EmitterFlags.Surface)
            for emitter in scene.emitters()
        )
        total = max(1, emitter_samples + bsdf_samples)
        self._emitter_share = emitter_samples / total
        self._bsdf_share = bsdf_samples / total

    def radiance(self, ray: Any, sampler: Any) -> tuple[Any, PrimaryHits]:
        """Of rays of the camera: a Color3f, and what they hit. All rays are active."""
        module = self._module
        active = dr.full(module.Bool, True, dr.width(ray))
        pi, face = self._hits.closest_hit(ray, active)
        si = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)
        radiance = dr.zeros(module.Color3f, dr.width(ray))
        if self._hide_emitters:
            si, face = self._behind_emitters(ray, si, face)
        else:
            radiance += si.emitter(self._scene).eval(si)
        primary = PrimaryHits(si, face)
        active = si.is_valid()
        bsdf = si.bsdf(ray)
        smooth = module.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        for _ in range(self._emitter_samples):
            radiance += self._emitter_sample(si, bsdf, sampler, active & smooth)
        for _ in range(self._bsdf_samples if self._lights_can_be_hit else 0):
            radiance += self._bsdf_sample(si, bsdf, sampler, active)
        return radiance, primary

    def _behind_emitters(self, ray: Any, si: Any, face: Any) -> tuple[Any, Any]:
        """What rays see that go through shapes that glow."""
        module = self._module
        glows = si.is_valid() & (si.shape.emitter() != None)  # noqa: E711 (a pointer array)
        onward = module.Ray3f(si.spawn_ray(ray.d))
        while dr.any(glows):
            pi, next_face = self._hits.closest_hit(onward, glows)
            behind = pi.compute_surface_interaction(ray, mi.RayFlags.All, glows)
            si = dr.select(glows, behind, si)
            face = dr.select(glows, next_face, face)
            glows &= pi.is_valid() & (pi.shape.emitter() != None)  # noqa: E711
            step = pi.compute_surface_interaction(onward, mi.RayFlags.Minimal, glows)
            onward = module.Ray3f(step.spawn_ray(ray.d))
        return si, face

    def _emitter_sample(self, si: Any, bsdf: Any, sampler: Any, active: Any) -> Any:
        """Contribution of one direction that the emitters choose."""
        ds, light = self._scene.sample_emitter_direction(
            si, sampler.next_2d(active), False, active
        )
        active = active & (ds.pdf != 0)
        active &= ~self._hits.any_hit(si.spawn_ray_to(ds.p), active)
        wo = si.to_local(ds.d)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo, active)
        weight = dr.select(
            ds.delta,
            1.0,
            power_heuristic(ds.pdf * self._emitter_share, pdf * self._bsdf_share)
            / self._emitter_samples,
        )
        return dr.select(active, weight * value * light, 0.0)

    def _bsdf_sample(self, si: Any, bsdf: Any, sampler: Any, active: Any) -> Any:
        """Contribution of one direction that the material chooses."""
        module = self._module
        # Mitsuba draws both in one call's arguments, and its compiler takes the last first.
        direction = sampler.next_2d(active)
        component = sampler.next_1d(active)
        bs, value = bsdf.sample(mi.BSDFContext(), si, component, direction, active)
        active = active & dr.any(value != 0)
        ray = si.spawn_ray(si.to_world(bs.wo))
        pi, _ = self._hits.closest_hit(ray, active)
        hit = pi.compute_surface_interaction(ray, mi.RayFlags.All, active)
        emitter = hit.emitter(self._scene, active)
        active &= emitter != None  # noqa: E711 (a pointer array)
        light = emitter.eval(hit, active)
        ds = module.DirectionSample3f(self._scene, hit, si)
        delta = module.has_flag(bs.sampled_type, mi.BSDFFlags.Delta)
        pdf = dr.select(delta, 0.0, self._scene.pdf_emitter_direction(si, ds, active))
        weight = (
            power_heuristic(bs.pdf * self._bsdf_share, pdf * self._emitter_share)
            / self._bsdf_samples
        )
        return dr.select(active, value * light * weight, 0.0)


def power_heuristic(pdf: Any, other_pdf: Any) -> Any:
    """Weight of a sample that could also have been taken with another density (Veach 1997,
    section 9.2.4, exponent 2); 0 where it is not finite."""
    square, other = dr.square(pdf), dr.square(other_pdf)
    weight = square / (square + other)
    return dr.select(dr.isfinite(weight), weight, 0.0)
