"""What features of a scene cost where its picture does not use them.

A tiny cube is put below everything else in a scene. Where it has the feature, all that the
renderer switches on for it is on, and no ray meets it that changes the picture; where it is
plain, nothing is. The picture is the same, and the times should be.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mlrt_plugin import prepare
from mlrt_plugin.errors import MlrtError
from mlrt_plugin.parsing import resolving_from

from .errors import BenchError
from .measure import in_turns, median
from .widening import widen

PLAIN = "none of them"
MATERIAL = '<bsdf type="diffuse">{}</bsdf>'
BOARD = '<texture type="checkerboard" name="{}"/>'
FLAT = '<boolean name="face_normals" value="true"/>'
FEATURES = {
    PLAIN: MATERIAL.format("") + FLAT,
    "textures": MATERIAL.format(BOARD.format("reflectance")) + FLAT,
    "vertex normals": MATERIAL.format(""),
    "alpha": '<bsdf type="mask">'
    + BOARD.format("opacity")
    + MATERIAL.format("")
    + f"</bsdf>{FLAT}",
    "an area light": MATERIAL.format("")
    + FLAT
    + '<emitter type="area"><float name="sampling_weight" value="0"/></emitter>',
}
"""What is said of the small shape. The light is never chosen, but a choice of two scales
random numbers anew, so that some are rounded otherwise."""

MOST_DIFFERING = 1e-5
"""Share of the pixels that may differ, as one does where a rounded number moves a shadow
ray over an edge."""


@dataclass
class FeatureTimes:
    """seconds: of the processor for a frame, all threads together, a number a round.
    differing: share of the pixels that are not those without the feature, bit for bit."""

    feature: str
    seconds: list[float]
    differing: float

    def ratio_to(self, plain: FeatureTimes) -> list[float]:
        """Of the times of each round, which lie next to one another."""
        return [a / b for a, b in zip(self.seconds, plain.seconds, strict=True)]


def with_shape(scene: Path, place: Sequence[float], size: float, content: str) -> str:
    """The XML of a scene with a small cube in it."""
    text = scene.read_text()
    end = text.rfind("</scene>")
    if end < 0:
        raise BenchError(f"scene '{scene}' does not end in </scene>: take another")
    x, y, z = (repr(float(c)) for c in place)
    cube = (
        f'<shape type="cube"><transform name="to_world"><scale value="{size!r}"/>'
        f'<translate x="{x}" y="{y}" z="{z}"/></transform>{content}</shape>'
    )
    return text[:end] + cube + text[end:]


def below_all(scene: Path) -> tuple[list[float], float]:
    """Where a small cube is below everything else of a scene and out of sight, and half
    its side.

    Raises BenchError if the scene cannot be loaded, or is not shaded natively.
    """
    try:
        plain = prepare(scene, resolution=(1, 1))
    except MlrtError as error:
        raise BenchError(str(error)) from error
    if plain.shading.path != "native":
        raise BenchError(f"{scene} is not shaded natively: {plain.shading.reason}")
    low, high = (np.array(corner) for corner in plain.tree.bounds)
    extent = float(np.max(high - low))
    middle = (low + high) / 2
    return [middle[0], low[1] - 1e-4 * extent, middle[2]], 1e-5 * extent


def prepared_with(
    scene: Path,
    content: str,
    resolution: int,
    folder: Path,
    cube: tuple[Sequence[float], float],
) -> Any:
    """A scene with a small cube of that place and size, and with the wide form of its tree;
    raises BenchError if it cannot be loaded."""
    path = folder / scene.name
    path.write_text(with_shape(scene, *cube, content))
    try:
        with resolving_from(scene.parent.resolve()):
            prepared = prepare(path, resolution=(resolution, resolution))
    except MlrtError as error:
        raise BenchError(str(error)) from error
    widen(prepared)
    return prepared


def measure_features(
    scene: Path, resolution: int, spp: int, rounds: int
) -> list[FeatureTimes]:
    """Frames of a scene with each feature, in turns; the first are those without any."""
    cube = below_all(scene)
    with tempfile.TemporaryDirectory() as folder:
        prepared = [
            prepared_with(scene, content, resolution, Path(folder), cube)
            for content in FEATURES.values()
        ]

    def frame(which: int) -> float:
        before = time.process_time()
        prepared[which].render(spp=spp)
        return time.process_time() - before

    images = [each.render(spp=spp).image for each in prepared]
    times = [
        FeatureTimes(name, [], float(np.mean(np.any(image != images[0], axis=2))))
        for name, image in zip(FEATURES, images, strict=True)
    ]
    runs = [lambda which=which: frame(which) for which in range(len(prepared))]
    for which, seconds in in_turns(runs, rounds):
        times[which].seconds.append(seconds)
    return times


def rows_of(times: list[FeatureTimes]) -> list[dict[str, Any]]:
    """The figures, with the ratios to the time without any feature: median and the range
    from the first to the third quartile."""
    rows = []
    for each in times:
        ratios = each.ratio_to(times[0])
        first, third = np.quantile(ratios, [0.25, 0.75])
        rows.append(
            {
                "feature": each.feature,
                "seconds": median(each.seconds),
                "ratio": median(ratios),
                "quartiles": [float(first), float(third)],
                "differing": each.differing,
                "same_picture": each.differing <= MOST_DIFFERING,
            }
        )
    return rows
