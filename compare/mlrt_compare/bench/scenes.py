"""The scenes of the benchmarks: triangles, a camera, and a point that light comes from."""

from __future__ import annotations

import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_files import replacing
from mlrt_plugin.errors import MlrtError
from mlrt_plugin.scene_arrays import Camera, SceneArrays
from mlrt_plugin.scene_import import import_scene
from mlrt_plugin.shape_arrays import NONE

from .errors import BenchError

STORED_FORMAT = 1
"""Of what is kept in the cache; part of its key."""


@dataclass(frozen=True)
class BenchScene:
    """What both engines are given.

    vertices: (V, 3) float32, world space. faces: (F, 3) uint32.
    view: the camera and the light, as the native side takes them.
    """

    name: str
    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    view: dict[str, Any]


@dataclass(frozen=True)
class SceneFile:
    """A scene that is there or not."""

    name: str
    path: Path
    remedy: str

    def file(self, cache: Path) -> Path:
        if not self.path.is_file():
            raise BenchError(f"there is no {self.path}: {self.remedy}")
        return self.path

    def load(self, cache: Path) -> BenchScene:
        return imported(self.name, self.file(cache))


@dataclass(frozen=True)
class GeneratedScene:
    """A scene that its generator writes, always the same one."""

    name: str
    folder: Path
    """With `generate.py`, which writes FOLDER/NAME.xml."""
    triangles: int
    seed: int = 1

    def key(self) -> str:
        digest = hashlib.sha256(f"{STORED_FORMAT}".encode())
        digest.update(f"\0{self.folder.name}\0{self.triangles}\0{self.seed}".encode())
        for path in sorted([*self.folder.parent.glob("*.py"), *self.folder.glob("*.py")]):
            digest.update(path.read_bytes())
        return digest.hexdigest()[:16]

    def file(self, cache: Path) -> Path:
        """The scene as XML, which stays in the cache."""
        folder = cache / "scenes" / f"{self.name}-{self.key()}"
        if not folder.is_dir():
            folder.parent.mkdir(parents=True, exist_ok=True)
            with self.generated(folder.parent) as written:
                written.parent.rename(folder)
        return folder / f"{self.folder.name}.xml"

    def load(self, cache: Path) -> BenchScene:
        stored = cache / "scenes" / f"{self.name}-{self.key()}.npz"
        if not stored.is_file():
            stored.parent.mkdir(parents=True, exist_ok=True)
            with self.generated(stored.parent) as written:
                store(stored, imported(self.name, written))
        return read_stored(stored, self.name)

    @contextmanager
    def generated(self, folder: Path) -> Iterator[Path]:
        """Writes the scene to a temporary folder in the given one; the XML file."""
        print(f"mlrt-bench: generating {self.name}", file=sys.stderr, flush=True)
        with tempfile.TemporaryDirectory(dir=folder, prefix=".generated-") as temporary:
            output = Path(temporary) / "scene"
            command = [
                *(sys.executable, str(self.folder / "generate.py")),
                *("--triangles", str(self.triangles), "--seed", str(self.seed)),
                *("-o", str(output)),
            ]
            child = subprocess.run(command, capture_output=True, text=True)
            if child.returncode != 0:
                reason = (child.stderr.strip() or "no message").splitlines()[-1]
                raise BenchError(f"the scene {self.name} cannot be generated: {reason}")
            yield output / f"{self.folder.name}.xml"


SceneSource = SceneFile | GeneratedScene


def usual_scenes(source: Path) -> list[SceneSource]:
    """Those of the published table, in its order, of a checkout."""
    third_party = source.parent / "shared" / "scenes"
    return [
        SceneFile("office", source / "scenes/office/office.xml", "restore it with git"),
        SceneFile(
            "conference",
            third_party / "conference/conference.xml",
            "put the conference room there, which may not be passed on with MLRT",
        ),
        GeneratedScene("building", source / "scenes/building", 2_200_000),
        GeneratedScene("dragon-2.2M", source / "scenes/dragon", 2_200_000),
        GeneratedScene("dragon-7.2M", source / "scenes/dragon", 7_200_000),
    ]


def scenes_of_rays(source: Path) -> list[SceneSource]:
    """The usual ones of `mlrt-bench rays`."""
    sponza = source.parent / "shared" / "scenes" / "sponza" / "sponza.xml"
    remedy = "put the atrium there, which may not be passed on with MLRT"
    return [
        *(scene for scene in usual_scenes(source) if scene.name != "dragon-2.2M"),
        SceneFile("sponza", sponza, remedy),
    ]


def chosen_scenes(
    names: list[str] | None, usual: Sequence[SceneSource]
) -> list[SceneSource]:
    """Scenes by name, or by the path of an XML file; all usual ones for None.

    Raises BenchError for a name that is neither.
    """
    if names is None:
        return list(usual)
    by_name = {scene.name: scene for scene in usual}
    chosen: list[SceneSource] = []
    for name in names:
        if name in by_name:
            chosen.append(by_name[name])
        elif name.endswith(".xml"):
            chosen.append(SceneFile(Path(name).stem, Path(name), "name another file"))
        else:
            raise BenchError(
                f"there is no scene '{name}': choose from {', '.join(by_name)}, or name an "
                "XML file"
            )
    return chosen


def imported(name: str, path: Path) -> BenchScene:
    try:
        arrays = import_scene(path, force_direct=True)
    except MlrtError as error:
        raise BenchError(f"the scene {name} cannot be read: {error}") from error
    view = {**camera_fields(arrays.camera), "light": light_position(arrays, name)}
    return BenchScene(name, arrays.vertices, arrays.faces, view)


def camera_fields(camera: Camera) -> dict[str, Any]:
    x, y, z = camera.axes
    return {
        "origin": camera.origin,
        "axis_x": x,
        "axis_y": y,
        "axis_z": z,
        "tan_half_fov_x": camera.tan_half_fov_x,
        "near_clip": camera.near_clip,
        "far_clip": camera.far_clip,
        "principal_point_x": camera.principal_point_offset[0],
        "principal_point_y": camera.principal_point_offset[1],
    }


def camera_of(view: dict[str, Any]) -> Camera:
    """Of the fields that `camera_fields` gives."""
    return Camera(
        origin=tuple(view["origin"]),
        axes=(tuple(view["axis_x"]), tuple(view["axis_y"]), tuple(view["axis_z"])),
        tan_half_fov_x=view["tan_half_fov_x"],
        near_clip=view["near_clip"],
        far_clip=view["far_clip"],
        principal_point_offset=(view["principal_point_x"], view["principal_point_y"]),
    )


def light_position(arrays: SceneArrays, name: str) -> tuple[float, ...]:
    """Of the first point or spot light, else the centroid of the first area light.

    Raises BenchError if the scene has neither.
    """
    for emitter in arrays.emitters:
        if emitter.type in ("point", "spot"):
            return emitter.position
    for emitter in arrays.emitters:
        if emitter.shape != NONE:
            shape = arrays.shapes[emitter.shape]
            faces = arrays.faces[shape.first_face : shape.first_face + shape.face_count]
            corners = arrays.vertices[faces].astype(np.float64)
            edges = corners[:, 1:] - corners[:, :1]
            areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
            centroid = np.average(corners.mean(axis=1), axis=0, weights=areas)
            return tuple(float(x) for x in centroid)
    raise BenchError(
        f"the scene {name} has no light that is at a place: add a point light to it"
    )


def store(path: Path, scene: BenchScene) -> None:
    with replacing(path) as temporary:
        np.savez(
            temporary,
            vertices=scene.vertices,
            faces=scene.faces,
            view=np.array(json.dumps(scene.view)),
        )


def read_stored(path: Path, name: str) -> BenchScene:
    with np.load(path) as arrays:
        view = json.loads(str(arrays["view"]))
        return BenchScene(name, arrays["vertices"], arrays["faces"], view)
