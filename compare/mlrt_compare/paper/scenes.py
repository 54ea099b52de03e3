"""The scenes of the paper's tables, and others: triangles, a camera and one light."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin.render import PreparedScene, prepare
from mlrt_plugin.scene_arrays import Emitter, Film, Lighting, SceneArrays
from mlrt_plugin.shape_arrays import Shape

from ..bench.errors import BenchError
from ..bench.scenes import (
    BenchScene,
    SceneSource,
    camera_of,
    chosen_scenes,
    usual_scenes,
)

USUAL = ("office", "conference", "building", "dragon")
LARGE_DRAGON = "dragon-7.2M"
"""What stands in for the paper's dragon: as many triangles."""
SHADOWED_TRIANGLES = 2**22
"""Above that shadow rays are traced for tables 2 and 3 only: one interval for rays that go
apart takes minutes a frame then; chosen."""
TREE = {"intersection_cost": 0.375}
"""How trees are built: with smaller leaves than usual, since the paper's packets walk them
themselves, one triangle after the other. The three rules matter little in large leaves."""


def paper_scenes(source: Path, names: Sequence[str] | None) -> list[SceneSource]:
    """Scenes of a checkout by name, or by the path of an XML file; for None the USUAL.

    Raises BenchError for a name that is neither.
    """
    usual = [
        dataclasses.replace(scene, name="dragon") if scene.name == LARGE_DRAGON else scene
        for scene in usual_scenes(source)
    ]
    return chosen_scenes(list(USUAL if names is None else names), usual)


def arrays_of(scene: BenchScene, side: int, *, light: bool) -> SceneArrays:
    """The scene in one grey, for a square film, lit by one point light or by none.

    Without a light a frame has camera rays only.
    """
    view = scene.view
    emitter = Emitter("point", (1.0, 1.0, 1.0), position=tuple(view["light"]))
    return SceneArrays(
        vertices=scene.vertices,
        faces=scene.faces,
        normals=np.zeros((0, 3), np.float32),
        shapes=(Shape(0, len(scene.faces), material=0),),
        materials=np.full((1, 2, 3), 0.5, np.float32),
        emitters=(emitter,) if light else (),
        camera=camera_of(view),
        film=Film(side, side, 0, 0, side, side, "box", 0.5),
        lighting=Lighting(),
        spp=1,
        base_seed=0,
        features=(),
        warnings=(),
    )


class StudiedScene:
    """A scene with one tree, ready to be traced without and with shadow rays."""

    def __init__(self, scene: BenchScene, side: int, **build: Any) -> None:
        """build: fields of `BuildOptions`, beside those of TREE. Raises BenchError if there
        is no triangle."""
        build = {**TREE, **build}
        if not len(scene.faces):
            raise BenchError(f"the scene {scene.name} has no triangle")
        self.scene = scene
        self.side = side
        self.lit = as_native(prepare(arrays_of(scene, side, light=True), **build))
        self.unlit = as_native(
            prepare(arrays_of(scene, side, light=False), previous=self.lit, **build)
        )

    @property
    def rays(self) -> int:
        """Of the camera, in a frame."""
        return self.side * self.side

    @property
    def shadows_are_quick(self) -> bool:
        return len(self.scene.faces) <= SHADOWED_TRIANGLES

    def counters_and_hits(
        self, options: Mapping[str, Any]
    ) -> tuple[Mapping[str, int], npt.NDArray[np.uint32]]:
        """Counters of a frame, and what must be the same whatever the options are: the bits
        of the image with shadow rays or, where these are not quick, of the distances and
        faces that are hit."""
        if self.shadows_are_quick:
            result = self.lit.render(**options)
            return result.counters, result.image.view(np.uint32)
        result = self.unlit.render(**options, aovs=("depth", "prim"))
        hits = [np.ascontiguousarray(result.aovs[name]) for name in ("depth", "prim")]
        return result.counters, np.stack([each.view(np.uint32) for each in hits])

    def prepared(self, shadows: bool) -> PreparedScene:
        return self.lit if shadows else self.unlit


def as_native(prepared: Any) -> PreparedScene:
    assert isinstance(prepared, PreparedScene)  # what arrays of a scene always give
    return prepared
