"""What is wrong with a light from all around is told in one sentence, with its remedy."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mlrt_plugin import MlrtError, render

SceneFile = Callable[..., Path]

PLACE = r"scene\.xml line \d+:\d+"
SKY = '<emitter type="envmap"><string name="filename" value="sky.exr"/>{}</emitter>'
CASES = {
    "missing file": (SKY.replace("sky.exr", "absent.exr"), "absent.exr.*check the path"),
    "empty file": (SKY.replace("sky.exr", "empty.exr"), "'envmap'.*empty.exr"),
    "NaN in the picture": (
        SKY.replace("sky.exr", "nan.exr"),
        f"'envmap' at .*{PLACE} has NaN or infinite pixels: repair 'nan.exr'",
    ),
    "flattened": (
        SKY.format('<transform name="to_world"><scale x="0"/></transform>'),
        f"'envmap' at .*{PLACE} has a singular to_world",
    ),
    "negative scale": (
        SKY.format('<float name="scale" value="-1"/>'),
        f"'envmap' at .*{PLACE} has scale = -1: it must be at least 0",
    ),
    "NaN scale": (SKY.format('<float name="scale" value="nan"/>'), "scale = nan"),
    "NaN radiance": (
        '<emitter type="constant"><rgb name="radiance" value="1, nan, 1"/></emitter>',
        f"'constant' at .*{PLACE} has a colour with NaN",
    ),
    "two of them": (
        '<emitter type="constant" id="dome"/>' + SKY,
        f"'envmap' at .*{PLACE} lights .* from all around, as emitter 'constant' with id "
        "'dome' at .* does: .*remove",
    ),
}


@pytest.mark.parametrize("shading", ["native", "auto"])
@pytest.mark.parametrize("name", CASES)
def test_bad_environment(scene_file: SceneFile, name: str, shading: str) -> None:
    emitters, expected = CASES[name]
    path = scene_file(emitters=emitters.format(""))
    random = np.random.default_rng(3)
    sky = random.random((5, 9, 3)).astype(np.float32)
    mi.Bitmap(sky).write(str(path.parent / "sky.exr"))
    sky[2, 3, 1] = np.nan
    mi.Bitmap(sky).write(str(path.parent / "nan.exr"))
    (path.parent / "empty.exr").write_bytes(b"")
    with pytest.raises(MlrtError, match=expected) as caught:
        render(path, shading=shading)
    assert "\n" not in str(caught.value)
