"""What a scene uses, and what of it is native, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from .errors import UnsupportedFeature
from .features import INTEGRATORS, SAMPLERS, warnings_about
from .scene_arrays import Feature
from .scene_import import SceneSource, import_scene, summarise

TAKEN_OVER = {"integrator": INTEGRATORS, "sampler": SAMPLERS}


def scene_report(
    scene: SceneSource, *, sensor: int = 0, defines: Mapping[str, object] | None = None
) -> list[str]:
    """Lines of text about a scene; its meshes are loaded only if it is native throughout.

    Raises SceneError if the scene cannot be read.
    """
    summary = summarise(scene, sensor=sensor, defines=defines)
    lines = [f"sensors: {summary.sensor_count}", "uses:"]
    counts = Counter((f.kind, f.plugin, f.native) for f in summary.features)
    for (kind, plugin, native), count in counts.items():
        lines.append(f"  {count} x {kind} '{plugin}': {verdict(kind, plugin, native)}")
    try:
        warnings = warnings_about(summary.features, summary.lighting)
    except UnsupportedFeature as error:
        warnings, refusal = [], [str(error)]
    else:
        refusal = []
    unsupported = [f for f in summary.features if not f.native]
    refusal += [reason(feature) for feature in unsupported]
    if refusal:
        lines += ["not supported:", *(f"  {text}" for text in refusal)]
        if warnings:
            lines += ["approximated or ignored:", *(f"  {text}" for text in warnings)]
        return lines
    arrays = import_scene(scene, sensor=sensor, defines=defines)
    film = arrays.film
    lines += [
        f"faces: {len(arrays.faces)}, vertices: {len(arrays.vertices)}, "
        f"vertex normals: {'used' if len(arrays.normals) else 'not used'}",
        f"materials: {len(arrays.materials)}, emitters: {len(arrays.emitters)}",
        f"film: {film.width}x{film.height}, {film.filter} filter, {arrays.spp} spp",
    ]
    if arrays.warnings:
        lines += ["approximated or ignored:", *(f"  {text}" for text in arrays.warnings)]
    return [*lines, "the scene is rendered natively"]


def verdict(kind: str, plugin: str, native: bool) -> str:
    if kind in TAKEN_OVER:
        return "taken over" if plugin in TAKEN_OVER[kind] else "replaced"
    return "native" if native else "not supported"


def reason(feature: Feature) -> str:
    return f"{feature}: {feature.reason}"
