"""Which part of the work of the scene's integrator is done, and what would be missing."""

from __future__ import annotations

from typing import Any

from . import mitsuba_objects as objects
from .elements import Element
from .errors import SceneError, UnsupportedFeature
from .materials import SPECULAR
from .options import INTEGRATOR_OPTIONS
from .scene_arrays import Feature, Lighting

TAKEN_OVER = ("direct", "path", "mlrt", "depth", "aov", "moment")
"""Integrators of which all is done, if their parameters allow it."""
MISSING = {
    "path": "the light of further bounces",
    "prb": "the light of further bounces",
    "prb_basic": "the light of further bounces",
    "prb_projective": "the light of further bounces",
    "ptracer": "the light of further bounces",
    "volpath": "the light of further bounces and participating media",
    "volpathmis": "the light of further bounces and participating media",
    "prbvolpath": "the light of further bounces and participating media",
    "moment": "the second moments",
    "stokes": "polarisation",
    "direct_projective": "the derivatives of moving edges",
    "volprim_rf_basic": "radiance fields",
}
"""What an integrator computes and `direct` does not."""
AOV_NAMES = {"depth": "depth", "sh_normal": "normal"}
"""Variables of Mitsuba's integrator `aov` that are had here, and their names."""
POINTLIKE = ("point", "spot", "projector", "directional")
"""Emitters whose light comes from one direction at each point, which no ray meets, so that
BSDF samples find nothing of them."""
MOST_SAMPLES = 256
"""Of emitters, and of BSDFs, of a camera sample, natively; chosen, as memory grows with
them."""
OWN_PARAMETERS = (
    "hide_emitters",
    "emitter_samples",
    "bsdf_samples",
    "shading",
    "shadow_offset",
    *INTEGRATOR_OPTIONS,
)
"""Parameters of the integrator `mlrt`."""


def lighting_of(root: Element) -> Lighting:
    """What the integrator of a parsed scene asks for, by default `direct`."""
    for integrator in root.children_of("integrator"):
        parameters = dict(integrator.properties)
        nested = list(integrator.children_of("integrator"))
        if integrator.plugin == "aov":
            variables = str(parameters.get("aovs", "")).replace(" ", "")
            pairs = [pair.partition(":") for pair in variables.split(",") if pair]
            parameters["aovs"] = tuple(variable for _, _, variable in pairs)
        if integrator.plugin in ("aov", "moment"):
            parameters["nested"] = [e.plugin for e in nested]
            if len(nested) == 1:
                parameters = {**nested[0].properties, **parameters}
        return lighting_for(parameters, integrator.plugin)
    return Lighting()


def loaded_lighting(scene: Any) -> Lighting:
    """What the integrator of a loaded scene asks for."""
    integrator = scene.integrator()
    if integrator is None:
        return Lighting()
    parameters = dict(getattr(integrator, "mlrt_parameters", {}))
    parameters["hide_emitters"] = bool(getattr(integrator, "hide_emitters", False))
    for name in ("emitter_samples", "bsdf_samples", "max_depth"):
        text = objects.described(integrator, name)
        if text:
            depth = int(text)
            parameters[name] = -1 if depth == 0xFFFFFFFF else depth
    if objects.plugin_name(integrator) == "aov":
        # What is nested in it does not show.
        parameters["aovs"] = tuple(integrator.aov_names())
    return lighting_for(parameters, objects.plugin_name(integrator))


def lighting_for(parameters: dict[str, Any], integrator: str) -> Lighting:
    """What an integrator asks for; `parameters` are its properties."""
    shading = int(parameters.get("shading_samples", 1))
    if integrator == "path" and parameters.get("max_depth", -1) in (0, 1):
        shading = 0  # no more than what glows
    return Lighting(
        integrator=integrator,
        emitter_samples=int(parameters.get("emitter_samples", shading)),
        bsdf_samples=int(
            parameters.get("bsdf_samples", 0 if integrator == "mlrt" else shading)
        ),
        hide_emitters=bool(parameters.get("hide_emitters", False)),
        parameters=dict(parameters),
    )


def named(features: tuple[Feature, ...], lighting: Lighting) -> str:
    """The integrator with its id and place, for messages."""
    integrator = lighting.integrator
    return next(
        (
            str(f)
            for f in reversed(features)
            if f.kind == "integrator" and f.plugin == integrator
        ),
        f"integrator '{integrator}'",
    )


def check_integrator(
    features: tuple[Feature, ...], lighting: Lighting, force_direct: bool
) -> None:
    """Raises UnsupportedFeature for an integrator that computes more than is done here,
    unless that part is asked for, and SceneError for parameters that make no sense."""
    name, parameters = named(features, lighting), lighting.parameters
    if lighting.integrator == "mlrt":
        for parameter in parameters:
            if parameter not in OWN_PARAMETERS:
                raise UnsupportedFeature(
                    f"{name} has no parameter '{parameter}': choose from "
                    f"{', '.join(OWN_PARAMETERS)}"
                )
    if lighting.integrator == "path" and parameters.get("max_depth", -1) == 0:
        raise SceneError(f"{name} has max_depth = 0, so its image is black: set it to 2")
    counts = lighting.emitter_samples, lighting.bsdf_samples
    if min(counts) < 0 or (max(counts) < 1 and lighting.integrator != "path"):
        raise SceneError(
            f"{name} has emitter_samples = {counts[0]} and bsdf_samples = {counts[1]}: one "
            "of them must be at least 1, and none negative"
        )
    missing = what_is_missing(lighting)
    if missing and not force_direct:
        raise UnsupportedFeature(
            f"{name} asks for more than direct illumination, and {missing} would be "
            "missing: allow that with --force-direct (force_direct=True in Python), or "
            'make it <integrator type="mlrt"/>'
        )


def what_is_missing(lighting: Lighting) -> str:
    """What the scene's integrator computes and is not done here; empty if nothing."""
    integrator, parameters = lighting.integrator, lighting.parameters
    if integrator == "path":
        depth = int(parameters.get("max_depth", -1))
        return "" if depth in (1, 2) else f"{MISSING['path']} (max_depth = {depth})"
    if integrator == "aov":
        absent = [name for name in parameters.get("aovs", ()) if name not in AOV_NAMES]
        if absent:
            return f"the AOV '{absent[0]}'"
        return what_is_missing_inside(parameters)
    if integrator == "moment" and parameters.get("nested"):
        return what_is_missing_inside(parameters)
    if integrator in TAKEN_OVER and integrator != "moment":
        return ""
    unknown = f"what '{integrator}' computes, which is none of Mitsuba's own integrators,"
    return MISSING.get(integrator, unknown)


def what_is_missing_inside(parameters: dict[str, Any]) -> str:
    """The same, of what is nested in `aov` and `moment`."""
    nested = parameters.get("nested", [])
    if len(nested) > 1:
        return "the images of all but the first of its integrators"
    inner = nested[0] if nested else "direct"
    if inner not in ("direct", "path", "mlrt"):
        return f"what integrator '{inner}' in it computes"
    if inner == "path" and int(parameters.get("max_depth", -1)) != 2:
        return MISSING["path"]
    return ""


def own_aovs(lighting: Lighting) -> tuple[str, ...]:
    """AOVs that the scene's integrator asks for, by their names here."""
    if lighting.integrator == "moment" and not what_is_missing(lighting):
        return ("moment",)
    if lighting.integrator != "aov":
        return ()
    wanted = lighting.parameters.get("aovs", ())
    return tuple(dict.fromkeys(AOV_NAMES[name] for name in wanted if name in AOV_NAMES))


def native_obstacle(features: tuple[Feature, ...], lighting: Lighting) -> str:
    """Why the samples that the integrator asks for are not taken natively; empty if they
    are, or if others have the same expected image."""
    if lighting.integrator == "depth":
        return ""
    name = named(features, lighting)
    for what in ("emitter_samples", "bsdf_samples"):
        count = getattr(lighting, what)
        if count > MOST_SAMPLES:
            return (
                f"{name} has {what} = {count}, and at most {MOST_SAMPLES} are taken "
                "natively: raise the samples per pixel instead"
            )
    if takes_bsdf_samples(features, lighting):
        specular = [
            f for f in features if f.kind == "bsdf" and f.plugin in SPECULAR and f.varies
        ]
        if specular:
            return (
                f"lights in {specular[0]} are found by BSDF samples, which {name} asks for "
                "and which are not taken natively where the index of refraction varies"
            )
    return ""


def takes_bsdf_samples(features: tuple[Feature, ...], lighting: Lighting) -> bool:
    """Whether BSDF samples are asked for and could find a light."""
    return (
        lighting.bsdf_samples > 0
        and lighting.integrator != "depth"
        and any(f.kind == "emitter" and f.plugin not in POINTLIKE for f in features)
    )


def integrator_warnings(features: tuple[Feature, ...], lighting: Lighting) -> list[str]:
    """What of the integrator's work is missing, or not what one would expect, a sentence
    each."""
    name = named(features, lighting)
    missing = what_is_missing(lighting)
    if missing:
        return [f"{name}: only direct illumination is rendered; {missing} is missing"]
    if lighting.integrator == "depth" or lighting.emitter_samples < 2:
        return []
    if any(f.kind == "emitter" and f.plugin in POINTLIKE for f in features):
        return [
            f"{name}: the light of {', '.join(POINTLIKE)} emitters is added "
            f"{lighting.emitter_samples} times with emitter_samples = "
            f"{lighting.emitter_samples}, as Mitsuba does it (its issue 1861): set it to 1"
        ]
    return []
