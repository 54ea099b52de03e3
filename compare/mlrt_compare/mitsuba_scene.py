"""Loads a scene in a variant of Mitsuba so that it renders what MLRT renders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mitsuba

from mlrt_plugin.errors import SceneError, one_sentence
from mlrt_plugin.parsing import resolving_from
from mlrt_plugin.threads import threads_for_files

from .settings import Settings

# Mitsuba's type stubs do not know what depends on the variant.
mi: Any = mitsuba


@dataclass(frozen=True)
class MitsubaScene:
    """A loaded scene, and the integrator to render it with."""

    scene: Any
    integrator: Any
    spp: int
    """Those of the settings, else the scene's."""


def load_mitsuba_scene(
    settings: Settings,
    variant: str,
    integrator: Mapping[str, Any] | None = None,
) -> MitsubaScene:
    """As mi.load_file does, with film size and integrator replaced; sets the
    variant.

    integrator: what to render, by default `direct` with as many samples as the scene's
    integrator asks for.
    Raises SceneError, one sentence, if Mitsuba cannot load the scene.
    """
    mi.set_variant(variant)
    try:
        return _loaded(settings, variant, integrator)
    except RuntimeError as error:
        raise SceneError(
            f"Mitsuba cannot load {settings.scene}: {one_sentence(str(error))}"
        ) from error


def _loaded(
    settings: Settings,
    variant: str,
    integrator: Mapping[str, Any] | None,
) -> MitsubaScene:
    config = mi.parser.ParserConfig(variant)
    with resolving_from(settings.scene.parent, *settings.folders):
        state = mi.parser.parse_file(config, str(settings.scene), **settings.defines)
        _align(state, settings)
        hide_emitters = bool(_of_integrator(state, "hide_emitters", False))
        both = _of_integrator(state, "shading_samples", 1)
        samples = {
            name: int(_of_integrator(state, name, both))
            for name in ("emitter_samples", "bsdf_samples")
        }
        # Merging moves meshes to the end, and lights with them; the order of the
        # emitters decides what a random number means, so it has to stay as declared.
        config.merge_meshes = not any(
            node.type == mi.ObjectType.Emitter and node.props.plugin_name() == "area"
            for node in state.nodes
        )
        mi.parser.transform_all(config, state)
        with threads_for_files():
            scene = mi.parser.instantiate(config, state)
    if settings.resolution is not None:
        for sensor in scene.sensors():
            _resize(sensor, settings.resolution)
    default = {
        "type": "direct",
        **samples,
        "hide_emitters": hide_emitters,
    }
    spp = settings.spp or int(scene.sensors()[settings.sensor].sampler().sample_count())
    return MitsubaScene(scene, mi.load_dict(dict(integrator or default)), spp)


def _of_integrator(state: Any, name: str, otherwise: Any) -> Any:
    """A parameter of the scene's integrator, nested or not."""
    for node in state.nodes:
        if node.type == mi.ObjectType.Integrator and name in node.props:
            return node.props[name]
    return otherwise


def _align(state: Any, settings: Settings) -> None:
    """Gives every film the wanted size."""
    for node in state.nodes:
        if node.type == mi.ObjectType.Film:
            node.props["pixel_format"] = "rgb"
            if settings.resolution is not None:
                node.props["width"], node.props["height"] = settings.resolution


def _resize(sensor: Any, size: tuple[int, int]) -> None:
    """Gives the size to a film that the scene does not declare, and Mitsuba adds."""
    if tuple(sensor.film().size()) != size:
        parameters = mi.traverse(sensor)
        parameters["film.size"] = size
        parameters["film.crop_size"] = size
        parameters.update()
