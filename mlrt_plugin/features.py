"""What of a scene is rendered natively, what is approximated, and what is not supported."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from .elements import Element
from .errors import UnsupportedFeature
from .options import INTEGRATOR_OPTIONS
from .scene_arrays import Feature, Lighting

SHAPES = ("obj", "ply", "serialized", "rectangle", "cube", "mesh")
BSDFS = ("diffuse", "twosided")
EMITTERS = ("point", "spot", "directional", "area")
SENSORS = ("perspective",)
FILMS = ("hdrfilm",)
FILTERS = ("box", "gaussian")
SAMPLERS = ("independent",)
INTEGRATORS = ("direct", "path", "mlrt")
CONSTANT_TEXTURES = ("uniform", "srgb", "d65", "regular", "irregular")
NO_BSDF_SAMPLES = (
    "BSDF samples are not taken, so area lights are noisier or less noisy than in Mitsuba; "
    "the expected image is the same"
)
OWN_PARAMETERS = (
    "hide_emitters",
    "emitter_samples",
    "bsdf_samples",
    "shadow_offset",
    *INTEGRATOR_OPTIONS,
)
"""Parameters of the integrator `mlrt`."""

NATIVE = {
    "shape": SHAPES,
    "bsdf": BSDFS,
    "emitter": EMITTERS,
    "sensor": SENSORS,
    "film": FILMS,
    "rfilter": FILTERS,
    "texture": CONSTANT_TEXTURES,
}


def used_elements(scene: Element, sensor: int) -> Iterator[Element]:
    """The elements that the image depends on: shapes, emitters, the chosen sensor, and what
    these hold. What is declared but never referred to is left out."""
    seen: set[int] = set()
    for kind in ("sensor", "shape", "emitter"):
        for number, child in enumerate(scene.children_of(kind)):
            if kind == "sensor" and number != sensor:
                continue
            if kind == "emitter" and child.plugin == "area":
                continue  # it counts where a shape refers to it
            for element in child.walk():
                if id(element) not in seen:
                    seen.add(id(element))
                    yield element


def reason_against(element: Element) -> str:
    """Why an element cannot be rendered natively; empty if it can."""
    kind, plugin = element.kind, element.plugin
    if kind == "sampler":
        return ""
    if kind not in NATIVE:
        return f"a {kind} is not supported yet"
    if plugin not in NATIVE[kind]:
        return (
            f"only {', '.join(n for n in NATIVE[kind] if n != 'mesh')} are supported so far"
        )
    if plugin == "spot" and any(
        name == "texture" and child.plugin != "uniform" for name, child in element.children
    ):
        return "the texture of a spot is not supported yet"
    if plugin == "twosided" and any(
        child.plugin != "diffuse" for child in element.children_of("bsdf")
    ):
        return "only diffuse materials can be nested in it so far"
    return ""


def list_features(scene: Element, sensor: int) -> tuple[Feature, ...]:
    """All elements that the image depends on, with the verdict on each."""
    found = [*used_elements(scene, sensor), *scene.children_of("integrator")]
    return tuple(
        Feature(
            e.kind,
            e.plugin,
            e.id,
            e.where,
            "" if e.kind == "integrator" else reason_against(e),
        )
        for e in found
    )


def refuse_unsupported(features: tuple[Feature, ...]) -> None:
    """Raises UnsupportedFeature with all that is not supported, each by its name."""
    unsupported = [f for f in features if not f.native]
    if not unsupported:
        return
    first = unsupported[0]
    message = f"{first} is not supported: {first.reason}"
    others: dict[str, list[str]] = {}
    for feature in unsupported[1:]:
        others.setdefault(f"{feature.kind} '{feature.plugin}'", []).append(
            place(feature, first.file)
        )
    if others:
        named = [f"{plugin} {', '.join(places)}" for plugin, places in others.items()]
        message += f"; not supported either: {'; '.join(named)}"
    raise UnsupportedFeature(message)


def place(feature: Feature, file: str) -> str:
    """Where an element is, its file left out if it is the one given."""
    where = feature.where
    if file and feature.file == file:
        where = where.removeprefix(file).lstrip()
    return " ".join(filter(None, (f"'{feature.id}'" if feature.id else "", where)))


def lighting_of(parameters: dict[str, Any], integrator: str) -> Lighting:
    """Which part of an integrator's work is asked for; `parameters` are its properties."""
    shading = int(parameters.get("shading_samples", 1))
    return Lighting(
        integrator=integrator,
        emitter_samples=int(parameters.get("emitter_samples", shading)),
        bsdf_samples=int(
            parameters.get("bsdf_samples", 0 if integrator == "mlrt" else shading)
        ),
        hide_emitters=bool(parameters.get("hide_emitters", False)),
        parameters=dict(parameters),
    )


def warnings_about(features: tuple[Feature, ...], lighting: Lighting) -> list[str]:
    """What is approximated or ignored, a sentence each.

    Raises UnsupportedFeature for an integrator that asks for an image without emitter
    samples.
    """
    warnings = []
    glowing = any(f.kind == "emitter" and f.plugin == "area" for f in features)
    integrator = lighting.integrator
    name = next(
        (str(f) for f in features if (f.kind, f.plugin) == ("integrator", integrator)),
        f"integrator '{integrator}'",
    )
    if integrator == "direct":
        if lighting.emitter_samples == 0:
            raise UnsupportedFeature(
                f"{name} has emitter_samples = 0, and light is found by emitter samples "
                "only: set emitter_samples to 1"
            )
        if lighting.emitter_samples > 1:
            warnings.append(
                f"{name}: emitter_samples = {lighting.emitter_samples} is taken as 1; "
                "raise the samples per pixel instead"
            )
        if lighting.bsdf_samples > 0 and glowing:
            warnings.append(f"{name}: {NO_BSDF_SAMPLES}")
    elif integrator == "path":
        depth = int(lighting.parameters.get("max_depth", -1))
        if depth in (0, 1):
            raise UnsupportedFeature(
                f"{name} has max_depth = {depth}, which leaves out direct illumination, "
                "and that is always rendered: set max_depth to 2"
            )
        if depth != 2:
            warnings.append(
                f"{name}: only direct illumination is rendered (max_depth = 2); "
                f"the further bounces of max_depth = {depth} are missing"
            )
        elif glowing:
            warnings.append(f"{name}: {NO_BSDF_SAMPLES}")
    elif integrator == "mlrt":
        for parameter in lighting.parameters:
            if parameter not in OWN_PARAMETERS:
                raise UnsupportedFeature(
                    f"{name} has no parameter '{parameter}': choose from "
                    f"{', '.join(OWN_PARAMETERS)}"
                )
        if lighting.emitter_samples != 1 or lighting.bsdf_samples != 0:
            raise UnsupportedFeature(
                f"{name} takes one emitter sample and no BSDF sample: set "
                "emitter_samples to 1 and bsdf_samples to 0, or leave them out"
            )
    else:
        warnings.append(f"{name} is not supported: direct illumination is rendered instead")
    for feature in features:
        if feature.kind == "sampler" and feature.plugin not in SAMPLERS:
            warnings.append(f"{feature} is not supported: 'independent' is used instead")
    return warnings
