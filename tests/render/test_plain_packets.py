"""Packets on one face are shaded by a shorter way, which leaves the picture as it is.

A picture with depth never takes that way; both have been compared with Mitsuba elsewhere.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import render_scenes
from core_scene import core_scene

from mlrt_plugin._dispatch import core

LIGHTS = {
    "two points": lambda: {
        "a": render_scenes.point_light(),
        "b": render_scenes.spot_light(),
    },
    "weighted points": lambda: {
        "a": render_scenes.point_light(),
        "b": render_scenes.spot_light(sampling_weight=0.4),
        "c": render_scenes.spot_light(sampling_weight=0.0),
    },
    "point and rectangle": lambda: {
        "a": render_scenes.rectangle_light(),
        "b": render_scenes.point_light(),
    },
    # More than there are lanes.
    "many points": lambda: {
        f"light{i}": {
            "type": "point",
            "position": [0.3 * i - 2.4, 2.5, 1.5],
            "intensity": render_scenes.rgb(3, 2, 1),
        }
        for i in range(17)
    },
}


def seen_from_behind(folder: Path) -> render_scenes.SceneDict:
    floor = {
        "type": "rectangle",
        "to_world": render_scenes.transform(
            render_scenes.rotate((1, 0, 0), 90), render_scenes.scale(3, 3, 1)
        ),
        "bsdf": {
            "type": "twosided",
            "front": render_scenes.diffuse(0.9, 0.1, 0.1),
            "back": render_scenes.diffuse(0.1, 0.2, 0.9),
        },
    }
    return render_scenes.room(folder, light=render_scenes.point_light(), floor=floor)


ROOMS = ["point", "spot", "directional", "rectangle", "mesh smooth", "sky", "several"]


@pytest.mark.parametrize(("samples", "emitter_samples"), [(1, 1), (3, 1), (16, 1), (4, 3)])
@pytest.mark.parametrize("name", ["behind", *LIGHTS, *ROOMS, "crop", "gaussian"])
def test_picture_does_not_depend_on_the_way(
    folder: Path, name: str, samples: int, emitter_samples: int
) -> None:
    if name == "behind":
        description = seen_from_behind(folder)
    elif name in LIGHTS:
        description = render_scenes.room(folder, **LIGHTS[name]())
    else:
        description = render_scenes.SCENES[name](folder)
    scene = core_scene(description)
    plain, general = (
        core.render(scene, samples, 2, aovs=aovs, emitter_samples=emitter_samples)["image"]
        for aovs in ([], ["depth"])
    )
    assert plain.any()
    np.testing.assert_array_equal(plain, general)
