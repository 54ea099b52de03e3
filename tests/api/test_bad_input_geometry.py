"""Meshes that are not what they should be: what is left of them is rendered as if nothing
else had been there, and a warning names what is missing."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt
import pytest
import scene_files
from kd_trees import BUILDERS, each_builder

from mlrt_plugin import MlrtWarning, SceneError, import_scene, render
from mlrt_plugin.cli import main
from mlrt_plugin.render import RenderResult, prepare

SEED = 20260212
NAN, INF = float("nan"), float("inf")
FloatArray = npt.NDArray[np.float32]
SceneFile = Callable[..., Path]

pytestmark = pytest.mark.usefixtures("scalar_variant")


def mesh(
    vertices: Any, faces: Any, name: str = "blob", emitter: dict[str, Any] | None = None
) -> Any:
    """A Mitsuba mesh without vertex normals."""
    vertices, faces = np.asarray(vertices, np.float32), np.asarray(faces, np.uint32)
    properties = mi.Properties()
    if emitter:
        properties["emitter"] = mi.load_dict(emitter)
    result = mi.Mesh(name, len(vertices), len(faces), props=properties)
    parameters = mi.traverse(result)
    parameters["vertex_positions"] = vertices.ravel()
    parameters["faces"] = faces.ravel()
    return result


def grid(n: int = 6) -> tuple[FloatArray, npt.NDArray[np.uint32]]:
    """A bumpy sheet in [-1, 1]^2 across z, its vertices row by row."""
    x, y = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1))
    z = 0.2 * np.sin(3 * x) * np.cos(2 * y)
    i = np.arange(n * (n + 1)).reshape(n, n + 1)[:, :-1].ravel()
    faces = np.concatenate(
        [np.stack([i, i + 1, i + n + 2], 1), np.stack([i, i + n + 2, i + n + 1], 1)]
    )
    return np.stack([x, y, z], -1).reshape(-1, 3).astype(np.float32), faces.astype(
        np.uint32
    )


def scene(size: float = 1.0, **more: Any) -> dict[str, Any]:
    """What is in [-size, size]^2 about z = 0, seen from +z in directional light."""
    return {
        "type": "scene",
        "integrator": {"type": "direct", "bsdf_samples": 0},
        "eye": {
            "type": "perspective",
            "fov": 40,
            "near_clip": 0.01 * size,
            "far_clip": 100 * size,
            "to_world": mi.ScalarTransform4f(
                np.array(
                    [[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 3 * size], [0, 0, 0, 1]], float
                )
            ),
            "sampler": {"type": "independent", "sample_count": 4},
            "film": {
                "type": "hdrfilm",
                "width": 24,
                "height": 24,
                "rfilter": {"type": "box"},
            },
        },
        "sun": {"type": "directional", "direction": [0.1, 0.2, -1]},
        **more,
    }


def rendered(source: Any, expected: str | None = None, **options: Any) -> RenderResult:
    """Renders a scene that one warning, or none, is to be given for."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", MlrtWarning)
        result = render(source, aovs=("prim", "depth"), **options)
    messages = [str(w.message) for w in caught if issubclass(w.category, MlrtWarning)]
    if expected is None:
        assert messages == []
    else:
        (message,) = messages
        assert re.search(expected, message), message
        assert "\n" not in message
        assert result.warnings == (message,)
    assert np.isfinite(result.image).all()
    return result


def assert_same_image(result: RenderResult, expected: RenderResult) -> None:
    np.testing.assert_array_equal(result.image, expected.image)
    np.testing.assert_array_equal(result.aovs["depth"], expected.aovs["depth"])
    assert (expected.image.max() > 0) == (expected.aovs["prim"] >= 0).any()


def with_bad_faces(value: float) -> tuple[Any, Any, npt.NDArray[np.bool_]]:
    """A sheet of which vertices have bad coordinates; which of its faces remain."""
    vertices, faces = grid()
    bad = [3, 17, 30]
    for k, vertex in enumerate(bad):
        vertices[vertex, k] = value
    return vertices, faces, ~np.isin(faces, bad).any(axis=1)


@each_builder
@pytest.mark.parametrize("value", [NAN, INF, -INF])
def test_faces_that_are_not_finite_are_left_out(builder: str, value: float) -> None:
    vertices, faces, good = with_bad_faces(value)
    options = BUILDERS[builder]
    result = rendered(
        scene(sheet=mesh(vertices, faces)),
        rf"'sheet' has {(~good).sum()} of {len(faces)} faces with NaN or infinite vertices",
        **options,
    )
    expected = rendered(scene(sheet=mesh(np.nan_to_num(vertices), faces[good])), **options)
    assert_same_image(result, expected)
    assert 0.3 < (expected.aovs["prim"] >= 0).mean() < 0.9
    seen = expected.aovs["prim"] >= 0
    numbers = np.flatnonzero(good)
    np.testing.assert_array_equal(
        result.aovs["prim"][seen], numbers[expected.aovs["prim"][seen]]
    )


def test_in_loaded_scenes_and_by_the_integrator() -> None:
    vertices, faces, good = with_bad_faces(NAN)
    message = rf"'sheet' has {(~good).sum()} of {len(faces)} faces"
    loaded = mi.load_dict(scene(sheet=mesh(vertices, faces, "sheet")))
    result = rendered(loaded, message)
    expected = rendered(scene(sheet=mesh(np.nan_to_num(vertices), faces[good])))
    assert_same_image(result, expected)
    integrator = mi.load_dict({"type": "mlrt"})
    with pytest.warns(MlrtWarning, match=message) as caught:
        image = np.array(mi.render(loaded, integrator=integrator, seed=0))
    assert len(caught) == 1
    np.testing.assert_array_equal(image, result.image)


def test_in_files_and_on_the_command_line(
    scene_file: SceneFile, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    square = [(2 * x - 1, 2 * y - 1, z) for x, y, z in scene_files.SQUARE]
    bad = [*square[:3], (INF, 0, 0)]
    (tmp_path / "bad.serialized").write_bytes(scene_files.serialized_bytes(bad))
    (tmp_path / "good.serialized").write_bytes(
        scene_files.serialized_bytes(square, scene_files.SQUARE_FACES[:1])
    )
    paths = [
        scene_file(f"{name}.xml", shapes=scene_files.mesh_shape(f"{name}.serialized"))
        for name in ("bad", "good")
    ]
    message = (
        f"shape 'serialized' with id 'mesh' at {paths[0]} line 13:2 has 1 of 2 faces with "
        "NaN or infinite vertices (they are left out)"
    )
    result = rendered(paths[0], re.escape(message))
    expected = rendered(paths[1])
    assert_same_image(result, expected)
    assert expected.image.max() > 0

    assert main(["render", str(paths[0]), "-o", str(tmp_path / "out.exr")]) == 0
    (line,) = [t for t in capsys.readouterr().err.splitlines() if "warning" in t]
    assert line.startswith(f"mlrt: warning: {message}")
    assert main(["tree", str(paths[0])]) == 0
    assert "1 of shape 'serialized' with id 'mesh'" in capsys.readouterr().out


@each_builder
def test_meshes_of_which_nothing_is_left(builder: str) -> None:
    vertices, faces = grid(3)
    options = BUILDERS[builder]
    lost = mesh(np.full_like(vertices, NAN), faces)
    message = r"'lost' has 18 of 18 faces .*\(nothing of it is left\)"
    alone = rendered(scene(lost=lost), message, **options)
    assert (alone.aovs["prim"] == -1).all()
    assert not alone.image.any()
    beside = rendered(scene(lost=lost, sheet=mesh(*grid())), message, **options)
    assert_same_image(beside, rendered(scene(sheet=mesh(*grid())), **options))


@pytest.mark.parametrize("bad", ["not finite", "without area", "too small", "too large"])
def test_lights_that_have_nothing_to_glow_on_are_refused(bad: str) -> None:
    vertices, faces = grid(3)
    scale = {"not finite": NAN, "without area": 0, "too small": 1e-25, "too large": 1e25}
    lamp = mesh(np.float64(vertices) * scale[bad], faces, emitter={"type": "area"})
    with pytest.raises(SceneError, match="'lamp' glows, but its area is zero or infinite"):
        import_scene(scene(lamp=lamp))


@pytest.mark.parametrize("value", [NAN, INF, 0.0])
def test_normals_that_give_no_direction(value: float) -> None:
    vertices, faces = grid()

    def smooth(broken: bool) -> Any:
        result = mi.Mesh("smooth", len(vertices), len(faces), has_vertex_normals=True)
        parameters = mi.traverse(result)
        parameters["vertex_positions"] = vertices.ravel()
        parameters["faces"] = faces.ravel()
        normals = np.tile(np.array([0, 0, 1], np.float32), (len(vertices), 1))
        flat = vertices.copy()
        flat[:, 2] = 0
        parameters["vertex_positions"] = flat.ravel()
        if broken:
            normals[[8, 24]] = value
        parameters["vertex_normals"] = normals.ravel()
        return result

    result = rendered(
        scene(sheet=smooth(True)),
        "'sheet' has 2 vertex normals that are zero or not finite",
    )
    assert_same_image(result, rendered(scene(sheet=smooth(False))))


@each_builder
def test_faces_without_area_are_counted_by_mesh(builder: str) -> None:
    vertices, faces = grid()
    points = np.repeat(faces[:7, :1], 3, axis=1)
    both = np.concatenate([faces, points])
    prepared = prepare(
        scene(sheet=mesh(vertices, both), other=mesh(*grid(2))), **BUILDERS[builder]
    )
    assert prepared.warnings == ()
    assert prepared.report["dropped_triangles"] == 7
    assert_same_image(
        rendered(scene(sheet=mesh(vertices, both)), **BUILDERS[builder]),
        rendered(scene(sheet=mesh(vertices, faces)), **BUILDERS[builder]),
    )


@each_builder
def test_meshes_of_faces_without_area(builder: str) -> None:
    vertices, faces = grid()
    line = vertices * np.array([1, 0, 0], np.float32)
    result = rendered(
        scene(line=mesh(line, faces)),
        "shape 'mesh' with id 'line' cannot be seen: 72 of its 72 faces have no area",
        **BUILDERS[builder],
    )
    assert (result.aovs["prim"] == -1).all()


@each_builder
@pytest.mark.parametrize("count", [1, 2])
def test_few_triangles(builder: str, count: int) -> None:
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0], [1, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2], [1, 3, 2]], np.uint32)[:count]
    result = rendered(scene(few=mesh(vertices, faces)), spp=64, **BUILDERS[builder])
    # The square measures 2 of the 6 tan(20 degrees) that the camera sees at its distance.
    share = (2 / (6 * np.tan(np.radians(20)))) ** 2 / (2 if count == 1 else 1)
    lit = result.image[..., 0].mean()
    cosine = 1 / np.linalg.norm([0.1, 0.2, 1])
    assert lit == pytest.approx(share * 0.5 * cosine / np.pi, rel=0.03)


@each_builder
def test_many_times_the_same_triangle(builder: str) -> None:
    vertices = np.array([[-1, -1, 0], [1, -1, 0], [-1, 1, 0]], np.float32)
    pile = np.tile(np.array([[0, 1, 2]], np.uint32), (100_000, 1))
    result = rendered(scene(pile=mesh(vertices, pile)), **BUILDERS[builder])
    assert_same_image(result, rendered(scene(one=mesh(vertices, pile[:1]))))
    assert set(np.unique(result.aovs["prim"])) == {-1, 0}


@each_builder
@pytest.mark.parametrize("exponent", [-100, -40, 40, 100])
def test_extreme_extents(builder: str, exponent: int) -> None:
    """Powers of two about 1e-30 and 1e30, for which the image is that of size 1."""
    vertices, faces = grid()
    size = 2.0**exponent
    options = BUILDERS[builder]
    usual = rendered(scene(sheet=mesh(vertices, faces)), **options)
    result = rendered(
        scene(size, sheet=mesh(np.float64(vertices) * size, faces)), **options
    )
    np.testing.assert_array_equal(result.aovs["prim"], usual.aovs["prim"])
    np.testing.assert_allclose(
        np.float64(result.aovs["depth"]) / size, usual.aovs["depth"], rtol=1e-5
    )
    np.testing.assert_allclose(result.image, usual.image, rtol=1e-5)
    assert usual.image.max() > 0.1


@pytest.mark.parametrize("size", [1e-25, 1e25])
def test_light_that_cannot_fall_off_is_refused(size: float) -> None:
    vertices, faces = grid()
    lamp = {"type": "point", "position": [0, 0, size]}
    sheet = mesh(np.float64(vertices) * size, faces)
    with pytest.raises(SceneError, match=r"measures 2.*e[+-]25 with its 'point' light"):
        render(scene(size, sheet=sheet, lamp=lamp))


@pytest.mark.parametrize("index", [49, 2**31, 2**32 - 1])
def test_indices_out_of_range_are_refused(index: int) -> None:
    vertices, faces = grid()
    faces[5, 1] = index
    with pytest.raises(SceneError, match=rf"'sheet' .*refers to vertex {index} of 49"):
        import_scene(scene(sheet=mesh(vertices, faces)))
