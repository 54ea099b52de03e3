"""Who can shade a scene."""

from __future__ import annotations

import dataclasses

from .settings import Settings

PATHS = ("native", "mitsuba")


def on_each_path(settings: Settings) -> tuple[list[Settings], str]:
    """The scene on each of the paths that it can take, or on the one that is asked for, and
    what `auto` says of it.

    Raises MlrtError for a scene that cannot be read.
    """
    from mlrt_plugin.parsing import resolving_from
    from mlrt_plugin.shading_choice import choose_shading

    with resolving_from(*settings.folders):
        chosen = choose_shading(
            settings.scene, sensor=settings.sensor, defines=settings.defines
        )
    paths = ("mitsuba",) if chosen.path == "mitsuba" else PATHS
    if settings.shading is not None:
        paths = (settings.shading,)
    return [dataclasses.replace(settings, shading=path) for path in paths], str(chosen)
