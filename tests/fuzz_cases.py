"""What is fed with random input: functions that either refuse it in one clear sentence or
do what their documentation says. They run in a process of their own, see `fuzz_process`."""

from __future__ import annotations

import pickle
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mlrt_plugin import KdTree, MlrtError, MlrtWarning, import_scene
from mlrt_plugin._dispatch import core
from mlrt_plugin.render import prepare, render

REFUSALS = (MlrtError, ValueError, TypeError)
SENTENCE_LIMIT = 600
Mesh = tuple[npt.NDArray[np.float32], npt.NDArray[np.uint32]]


def soup(count: int = 40) -> Mesh:
    """Random triangles around the origin, the same each time."""
    random = np.random.default_rng(20261128)
    centers = random.uniform(-1, 1, (count, 1, 3))
    corners = centers + random.normal(scale=0.3, size=(count, 3, 3))
    faces = np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)
    return corners.reshape(-1, 3).astype(np.float32), faces


def tree_file(data: bytes) -> None:
    """A tree that is accepted must give the hits of brute force, nothing less."""
    scene = soup()
    random = np.random.default_rng(5)
    origins = random.normal(size=(64, 3))
    directions = random.normal(size=(64, 3))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "tree"
        path.write_bytes(data)
        tree = KdTree.load(path, *scene)
    tree.report  # noqa: B018
    for way in ("single", "wide", "packet", "adaptive"):
        hits = tree.closest_hit(origins, directions, traversal=way)
        assert np.isin(hits.primitive, np.arange(-1, len(scene[1]))).all()
        tree.any_hit(origins, directions, traversal=way)


def scene_file(files: dict[str, bytes]) -> None:
    """The scene `scene.xml` and its meshes; a picture of it has its size and no NaN."""
    with tempfile.TemporaryDirectory() as folder:
        for name, data in files.items():
            (Path(folder) / name).write_bytes(data)
        arrays = import_scene(Path(folder) / "scene.xml", resolution=(6, 5))
        assert np.isfinite(arrays.vertices).all()
        assert arrays.faces.size == 0 or arrays.faces.max() < len(arrays.vertices)
        prepared = prepare(arrays)
        for offset in ("mitsuba", "robust"):
            image = prepared.render(spp=1, shadow_offset=offset).image
            assert image.shape == (5, 6, 3)
            assert not np.isnan(image).any()


def ray_arrays(
    origins: Any, directions: Any, t_min: Any, t_max: Any, options: dict[str, Any]
) -> None:
    """Hits are those of the same rays in single precision, contiguous, one by one; rays
    that make no sense miss."""
    vertices, faces = soup()
    tree = KdTree(vertices, faces)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # NumPy's, of casts out of range
        hits = tree.closest_hit(origins, directions, t_min, t_max, **options)
        occluded = tree.any_hit(origins, directions, t_min, t_max, **options)
        o = np.array(origins, np.float32)
        d = np.array(directions, np.float32)
        lower = np.broadcast_to(np.array(t_min, np.float32), len(o))
        upper = np.broadcast_to(np.array(t_max, np.float32), len(o))
    assert hits.t.shape == hits.primitive.shape == occluded.shape == (len(o),)
    finite = np.isfinite(o).all(axis=1) & np.isfinite(d).all(axis=1) & d.any(axis=1)
    active = finite & (np.maximum(lower, 0) < upper)
    assert (hits.primitive[~active] == -1).all()
    assert np.isinf(hits.t[hits.primitive < 0]).all()
    np.testing.assert_array_equal(occluded, hits.primitive >= 0)
    for i in np.flatnonzero(active):
        alone = tree.closest_hit(
            o[i : i + 1], d[i : i + 1], lower[i], upper[i], traversal="brute_force"
        )
        assert (alone.t[0], alone.primitive[0]) == (hits.t[i], hits.primitive[i])
        if hits.primitive[i] >= 0:
            assert max(lower[i], 0) < hits.t[i] <= upper[i]


def mesh_arrays(vertices: Any, faces: Any, options: dict[str, Any]) -> None:
    """A tree over arrays of any kind, and rays through it by two ways."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MlrtWarning)
        tree = KdTree(vertices, faces, **options)
    random = np.random.default_rng(7)
    rays = random.normal(size=(2, 40, 3))
    expected = tree.closest_hit(*rays, traversal="brute_force")
    for way in ("adaptive", "wide"):
        for mine, theirs in zip(
            tree.closest_hit(*rays, traversal=way), expected, strict=True
        ):
            np.testing.assert_array_equal(mine, theirs)


def core_arrays(function: str, arguments: list[Any]) -> None:
    """The native core itself, without what Python checks before."""
    tree = core.KdTree(*soup())
    call = core.KdTree if function == "KdTree" else getattr(tree, function)
    with np.errstate(over="ignore"):  # where nanobind casts
        try:
            call(*arguments)
        except IndexError as error:  # of a face; elsewhere it would be a defect
            raise ValueError(str(error)) from error


def render_arguments(arguments: dict[str, Any]) -> None:
    render(
        {
            "type": "scene",
            "integrator": {"type": "direct", "bsdf_samples": 0},
            "lamp": {"type": "point", "position": [1, 2, 3]},
            "floor": {"type": "rectangle"},
            "eye": {
                "type": "perspective",
                "film": {"type": "hdrfilm", "width": 4, "height": 3},
            },
        },
        **arguments,
    )


CASES = {
    case.__name__: case
    for case in (
        tree_file,
        scene_file,
        ray_arrays,
        mesh_arrays,
        core_arrays,
        render_arguments,
    )
}


def outcome(name: str, pickled: bytes) -> str:
    """`done`, or `refused: ` and why; raises for anything else."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MlrtWarning)
            CASES[name](*pickle.loads(pickled))
    except REFUSALS as error:
        # nanobind lists the signatures that it has on further lines.
        message = str(error)
        if name != "core_arrays":
            assert message, "the refusal says nothing"
            assert "\n" not in message, f"more than a sentence: {message}"
            assert len(message) < SENTENCE_LIMIT, f"more than a sentence: {message}"
            assert ".cpp" not in message, f"no sentence for users: {message}"
        return f"refused: {message}"
    return "done"
