"""What a scene uses, who renders it, and why, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import mlrt_llvm

from .errors import SceneError
from .features import MESHES, REFUSED
from .integrators import (
    TAKEN_OVER,
    check_integrator,
    integrator_warnings,
    takes_bsdf_samples,
)
from .scene_import import SceneSource, SceneSummary, import_scene, summarise
from .shading_choice import choice_for


def scene_report(
    scene: SceneSource,
    *,
    sensor: int = 0,
    defines: Mapping[str, object] | None = None,
    shading: str | None = None,
) -> list[str]:
    """Lines of text about a scene; its meshes are loaded only if it is native throughout.

    Raises SceneError if the scene cannot be read.
    """
    summary = summarise(scene, sensor=sensor, defines=defines)
    choice = choice_for(summary, shading, summary.lighting)
    native = choice.path == "native"
    lines = [f"sensors: {summary.sensor_count}", "uses:"]
    counts = Counter((f.kind, f.plugin, f.native) for f in summary.features)
    for (kind, plugin, is_native), count in counts.items():
        verdict = verdict_on(kind, plugin, is_native, native)
        lines.append(f"  {count} x {kind} '{plugin}': {verdict}")
    other = [f for f in summary.features if not f.native]
    if other:
        lines.append("not supported:" if native else "not native:")
        lines += [f"  {feature}: {feature.reason}" for feature in other]
    refusal = refusal_of(summary)
    if refusal:
        lines.append(f"needs --force-direct: {refusal}")
    warnings = integrator_warnings(summary.features, summary.lighting)
    if native and not other and not refusal:
        arrays = import_scene(scene, sensor=sensor, defines=defines, summary=summary)
        film = arrays.film
        lines += [
            f"faces: {len(arrays.faces)}, vertices: {len(arrays.vertices)}, "
            f"vertex normals: {'used' if len(arrays.normals) else 'not used'}",
            f"materials: {len(arrays.materials)}, emitters: {len(arrays.emitters)}",
            f"film: {film.width}x{film.height}, {film.filter} filter, {arrays.spp} spp",
            light_samples(summary),
        ]
        warnings = list(arrays.warnings)
    if warnings:
        lines += ["approximated or ignored:", *(f"  {text}" for text in warnings)]
    lines.append(f"shading: {choice}")
    if not native:
        try:
            mlrt_llvm.activate()
        except mlrt_llvm.LlvmUnavailable as error:
            lines.append(f"cannot be rendered: {error}")
    return lines


def light_samples(summary: SceneSummary) -> str:
    """How light is found natively."""
    lighting = summary.lighting
    if lighting.integrator == "depth":
        return "light samples: none"
    bsdfs = lighting.bsdf_samples if takes_bsdf_samples(summary.features, lighting) else 0
    return f"light samples: {lighting.emitter_samples} of emitters, {bsdfs} of BSDFs"


def verdict_on(kind: str, plugin: str, is_native: bool, path_is_native: bool) -> str:
    """What becomes of a plugin."""
    if kind == "integrator":
        return "taken over" if plugin in TAKEN_OVER else "direct illumination only"
    if not path_is_native:
        if (kind, plugin) in REFUSED:
            return "not supported"
        return "hits native" if kind == "shape" and plugin in MESHES else "by Mitsuba"
    return "native" if is_native else "not supported"


def refusal_of(summary: SceneSummary) -> str:
    """Why the scene's integrator is not taken over; empty if it is."""
    try:
        check_integrator(summary.features, summary.lighting, force_direct=False)
    except SceneError as error:
        return str(error)
    return ""
