"""Reading scenes: what the arrays hold, against Mitsuba's own objects and known
geometry."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files

from mlrt_plugin.scene_arrays import Camera
from mlrt_plugin.scene_import import import_scene
from mlrt_plugin.shape_arrays import NONE

SceneFile = Callable[..., Path]

ROTATED = """<transform name="to_world">
    <scale x="2" y="3"/><rotate x="1" angle="90"/><translate x="5"/>
</transform>"""


def test_rectangle_with_a_transformation(scene_file: SceneFile) -> None:
    scene = import_scene(scene_file(shapes=f'<shape type="rectangle">{ROTATED}</shape>'))
    # By hand: (x, y, 0) -> (2x + 5, 0, 3y).
    expected = [(2 * x + 5, 0, 3 * y) for y in (-1, 1) for x in (-1, 1)]
    np.testing.assert_allclose(scene.vertices, expected, atol=1e-6)
    corners = scene.vertices[scene.faces]
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    # Half of the 4 by 6 rectangle each; its normal (0, 0, 1) is turned to (0, -1, 0).
    np.testing.assert_allclose(areas, [(0, -12, 0)] * 2, atol=1e-5)
    assert scene.normals.shape == (0, 3)
    assert [(s.first_face, s.face_count) for s in scene.shapes] == [(0, 2)]
    np.testing.assert_allclose(scene.materials, [[[0.5] * 3, [0] * 3]])


def test_shapes_follow_one_another(scene_file: SceneFile) -> None:
    shapes = '<shape type="cube"/>' + scene_files.FLOOR + '<shape type="cube"/>'
    scene = import_scene(scene_file(shapes=shapes))
    assert [(s.first_face, s.face_count) for s in scene.shapes] == [
        (0, 12),
        (12, 2),
        (14, 12),
    ]
    assert [s.vertex_normals for s in scene.shapes] == [True, False, True]
    for shape in scene.shapes:
        faces = scene.faces[shape.first_face : shape.first_face + shape.face_count]
        corners = scene.vertices[faces]
        np.testing.assert_allclose(np.abs(corners[..., :2]), 1)
        if shape.vertex_normals:
            outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            np.testing.assert_allclose(scene.normals[faces][:, 0], outward / 4, atol=1e-6)


@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("flip", [False, True])
def test_normals_as_mitsuba_uses_them(
    scene_file: SceneFile, tmp_path: Path, smooth: bool, flip: bool, scalar_variant: None
) -> None:
    (tmp_path / "bent.ply").write_bytes(
        scene_files.ply_bytes([(0, 0, 0), (1, 0, 0), (0, 1, 0.2), (1, 1, 0.5)])
    )
    more = f'<boolean name="face_normals" value="{str(not smooth).lower()}"/>'
    more += f'<boolean name="flip_normals" value="{str(flip).lower()}"/>'
    path = scene_file(shapes=scene_files.mesh_shape("bent.ply", more))
    scene = import_scene(path)
    (shape,) = scene.shapes
    assert (shape.vertex_normals, shape.flip_normals) == (smooth, flip)
    loaded = mi.load_file(str(path))
    ray = mi.Ray3f(mi.Point3f(0.6, 0.7, 3), mi.Vector3f(0, 0, -1))
    hit = loaded.ray_intersect(ray)
    face = scene.faces[hit.prim_index]
    a, b, c = scene.vertices[face].astype(np.float64)
    if smooth:
        system = np.column_stack([b - a, c - a])[:2]
        u, v = np.linalg.solve(system, np.array([0.6, 0.7]) - a[:2])
        normal = np.array([1 - u - v, u, v]) @ scene.normals[face]
    else:
        normal = np.cross(b - a, c - a)
    normal *= (-1 if flip else 1) / np.linalg.norm(normal)
    np.testing.assert_allclose(np.array(hit.sh_frame.n), normal, atol=1e-5)


MESH_FILES = {
    "mesh.ply": scene_files.ply_bytes(),
    "text.ply": scene_files.ply_bytes(text=True),
    "mesh.obj": scene_files.OBJ.encode(),
    "mesh.serialized": scene_files.serialized_bytes(),
}


@pytest.mark.parametrize("name", MESH_FILES)
def test_mesh_files(scene_file: SceneFile, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(MESH_FILES[name])
    scene = import_scene(scene_file(shapes=scene_files.mesh_shape(name)))
    count = 1 if name.endswith("obj") else 2
    corners = scene.vertices[scene.faces]
    expected = np.array(scene_files.SQUARE)[np.array(scene_files.SQUARE_FACES)][:count]
    np.testing.assert_array_equal(corners, expected)


def test_materials(scene_file: SceneFile) -> None:
    red = '<bsdf type="diffuse"><rgb name="reflectance" value="0.7, 0.1, 0.2"/></bsdf>'
    grey = '<bsdf type="diffuse"><spectrum name="reflectance" value="0.25"/></bsdf>'
    shapes = [
        "",
        red,
        f'<bsdf type="twosided">{red}</bsdf>',
        f'<bsdf type="twosided">{red}{grey}</bsdf>',
        red,
    ]
    scene = import_scene(
        scene_file(shapes="".join(f'<shape type="rectangle">{s}</shape>' for s in shapes))
    )
    rows = scene.materials[[s.material for s in scene.shapes]]
    r, g, black = [0.7, 0.1, 0.2], [0.25] * 3, [0.0] * 3
    expected = [[[0.5] * 3, black], [r, black], [r, r], [r, g], [r, black]]
    np.testing.assert_allclose(rows, expected, rtol=1e-6)
    assert len(scene.materials) == 4


EMITTERS = """
<emitter type="spot">
    <transform name="to_world"><lookat origin="1,2,3" target="1,2,0"
    up="0,1,0"/></transform> <rgb name="intensity" value="1, 2, 3"/>
    <float name="cutoff_angle" value="40"/><float name="beam_width" value="25"/>
</emitter>
<emitter type="directional">
    <vector name="direction" value="0, -3, 4"/><rgb name="irradiance" value="4, 5, 6"/>
    <float name="sampling_weight" value="2.5"/>
</emitter>
<shape type="rectangle" id="panel">
    <emitter type="area"><rgb name="radiance" value="7, 8, 9"/></emitter>
    <transform name="to_world"><scale value="2"/><translate z="-1"/></transform>
</shape>
<shape type="cube" id="block"><emitter type="area"/></shape>
<emitter type="point"><point name="position" value="3, 2, 1"/></emitter>
"""


def test_emitters(scene_file: SceneFile, scalar_variant: None) -> None:
    path = scene_file(emitters=EMITTERS)
    scene = import_scene(path)
    loaded = mi.load_file(str(path), optimize=False)
    # Emitter sampling depends on the order, which is Mitsuba's.
    classes = {
        "SpotLight": "spot",
        "DirectionalEmitter": "directional",
        "AreaLight": "area",
        "PointLight": "point",
    }
    order = [classes[e.class_name()] for e in loaded.emitters()]
    assert [e.type for e in scene.emitters] == order
    spot = next(e for e in scene.emitters if e.type == "spot")
    assert spot.position == (1, 2, 3)
    np.testing.assert_allclose(spot.direction, (0, 0, -1), atol=1e-6)
    assert spot.radiance == (1, 2, 3)
    assert math.degrees(spot.cutoff_angle) == pytest.approx(40)
    assert math.degrees(spot.beam_width) == pytest.approx(25)
    sun = next(e for e in scene.emitters if e.type == "directional")
    np.testing.assert_allclose(sun.direction, (0, -0.6, 0.8), atol=1e-6)
    assert (sun.radiance, sun.sampling_weight) == ((4, 5, 6), 2.5)
    panel, block = (e for e in scene.emitters if e.type == "area")
    assert (panel.rectangle, block.rectangle) == (True, False)
    assert (panel.corner, panel.edge_u, panel.edge_v) == (
        (-2, -2, -1),
        (4, 0, 0),
        (0, 4, 0),
    )
    for index, emitter in enumerate(scene.emitters):
        if emitter.type == "area":
            assert scene.shapes[emitter.shape].emitter == index
    assert [s.face_count for s in scene.shapes if s.emitter != NONE] == [2, 12]


CAMERAS = {
    "plain": "",
    "fov_axis": '<string name="fov_axis" value="larger"/><float name="fov" value="70"/>',
    "principal point": '<float name="principal_point_offset_x" value="0.2"/>'
    '<float name="principal_point_offset_y" value="-0.1"/>',
    "clipping": '<float name="near_clip" value="0.5"/><float name="far_clip" value="20"/>',
}
CROP = """<integer name="crop_offset_x" value="3"/><integer name="crop_offset_y" value="2"/>
<integer name="crop_width" value="9"/><integer name="crop_height" value="5"/>"""


@pytest.mark.parametrize("crop", ["", CROP], ids=["whole", "crop"])
@pytest.mark.parametrize("name", CAMERAS)
def test_camera_rays(
    scene_file: SceneFile, name: str, crop: str, scalar_variant: None
) -> None:
    film = scene_files.FILM.replace("<rfilter", crop + "<rfilter")
    sensor = (
        f'<sensor type="perspective">{CAMERAS[name]}{scene_files.TO_WORLD}{film}</sensor>'
    )
    path = scene_file(sensor=sensor)
    scene = import_scene(path)
    mitsuba_sensor = mi.load_file(str(path)).sensors()[0]
    generator = np.random.default_rng(1)
    for s in generator.random((20, 2)):
        ray, _ = mitsuba_sensor.sample_ray(0.0, 0.5, mi.Point2f(s), mi.Point2f(0.5))
        origin, direction, far = pinhole_ray(
            scene.camera, dataclasses.asdict(scene.film), s
        )
        np.testing.assert_allclose(np.array(ray.o), origin, atol=1e-5)
        np.testing.assert_allclose(np.array(ray.d), direction, atol=1e-5)
        assert ray.maxt == pytest.approx(far, rel=1e-5)


def pinhole_ray(
    camera: Camera, film: dict[str, int], sample: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float]:
    """The ray through a point of the crop window, `sample` in fractions of that window."""
    size = np.array([film["width"], film["height"]])
    crop = np.array([film["crop_x"], film["crop_y"]])
    crop_size = np.array([film["crop_width"], film["crop_height"]])
    u, v = (crop + sample * crop_size) / size + camera.principal_point_offset
    tangent = camera.tan_half_fov_x
    local = np.array([(1 - 2 * u) * tangent, (1 - 2 * v) * tangent * size[1] / size[0], 1])
    local /= np.linalg.norm(local)
    direction = local @ np.array(camera.axes)
    origin = np.array(camera.origin) + direction * camera.near_clip / local[2]
    return origin, direction, (camera.far_clip - camera.near_clip) / local[2]


@pytest.mark.parametrize("stddev", [0.5, 0.8])
def test_gaussian_filter(
    scene_file: SceneFile, stddev: float, scalar_variant: None
) -> None:
    rfilter = f'<rfilter type="gaussian"><float name="stddev" value="{stddev}"/></rfilter>'
    film = scene_files.FILM.replace('<rfilter type="box"/>', rfilter)
    path = scene_file(sensor=f'<sensor type="perspective">{film}</sensor>')
    read = import_scene(path).film
    reference = mi.load_file(str(path)).sensors()[0].film().rfilter()
    assert read.filter == "gaussian"
    assert read.filter_radius == pytest.approx(reference.radius())
    offset = math.exp(-((read.filter_radius / read.filter_stddev) ** 2) / 2)
    for x in np.linspace(0, read.filter_radius, 9):
        value = math.exp(-((x / read.filter_stddev) ** 2) / 2) - offset
        # Mitsuba evaluates a polynomial fit.
        assert float(reference.eval(x)) == pytest.approx(value, abs=2e-3)


@pytest.mark.parametrize("name", ["tent", "mitchell", "catmullrom", "lanczos"])
def test_other_filters(scene_file: SceneFile, name: str, scalar_variant: None) -> None:
    film = scene_files.FILM.replace('"box"', f'"{name}"')
    path = scene_file(sensor=f'<sensor type="perspective">{film}</sensor>')
    read = import_scene(path).film
    reference = mi.load_file(str(path)).sensors()[0].film().rfilter()
    assert (read.filter, read.filter_radius) == (name, reference.radius())


@pytest.mark.parametrize(("b", "c"), [(1 / 3, 1 / 3), (0.5, 0.1), (0, 0.5), (1.5, -0.3)])
def test_parameters_of_the_mitchell_filter(
    scene_file: SceneFile, b: float, c: float
) -> None:
    film = scene_files.FILM.replace(
        '<rfilter type="box"/>',
        f'<rfilter type="mitchell"><float name="B" value="{b}"/>'
        f'<float name="C" value="{c}"/></rfilter>',
    )
    path = scene_file(sensor=f'<sensor type="perspective">{film}</sensor>')
    read = import_scene(path).film
    assert (read.filter_b, read.filter_c) == pytest.approx((b, c), abs=2e-6)


def test_arrays_cannot_be_changed(scene_file: SceneFile) -> None:
    scene = import_scene(scene_file())
    for array in (scene.vertices, scene.faces, scene.normals, scene.materials):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.spp = 3  # type: ignore[misc]


def test_sampler_and_integrator(scene_file: SceneFile) -> None:
    sampler = """<sampler type="independent">
        <integer name="sample_count" value="9"/>
        <integer name="seed" value="4"/></sampler>"""
    sensor = f'<sensor type="perspective">{sampler}{scene_files.FILM}</sensor>'
    integrator = """<integrator type="path"><integer name="max_depth" value="2"/>
        <boolean name="hide_emitters" value="true"/></integrator>"""
    scene = import_scene(scene_file(sensor=sensor, integrator=integrator))
    assert (scene.spp, scene.base_seed) == (9, 4)
    assert scene.lighting.integrator == "path"
    assert scene.lighting.hide_emitters
    assert scene.warnings == ()


def test_choice_of_the_sensor(scene_file: SceneFile) -> None:
    other = scene_files.SENSOR.replace('id="eye"', "").replace('value="16"', 'value="32"')
    path = scene_file(sensor=scene_files.SENSOR + other)
    assert [import_scene(path, sensor=i).film.width for i in (0, 1)] == [16, 32]


def test_defines_and_resolution(scene_file: SceneFile) -> None:
    path = scene_file(
        sensor=scene_files.SENSOR.replace('value="16"', 'value="$w"'),
        extra='<default name="w" value="24"/>',
    )
    # A default must stand before its use.
    text = path.read_text().replace('<default name="w" value="24"/>', "")
    path.write_text(
        text.replace("<integrator", '<default name="w" value="24"/><integrator', 1)
    )
    assert import_scene(path).film.width == 24
    assert import_scene(path, defines={"w": 48}).film.width == 48
    film = import_scene(path, resolution=(10, 20)).film
    assert (film.width, film.height, film.crop_width, film.crop_height) == (10, 20, 10, 20)


def test_resolution_respects_the_axis_of_the_field_of_view(scene_file: SceneFile) -> None:
    sensor = scene_files.SENSOR.replace(
        "<sampler",
        '<float name="fov" value="90"/><string name="fov_axis" value="y"/><sampler',
    )
    camera = import_scene(scene_file(sensor=sensor), resolution=(30, 10)).camera
    assert camera.tan_half_fov_x == pytest.approx(3)


def test_dictionary_is_the_same_scene_as_the_file(
    scene_file: SceneFile, scalar_variant: None
) -> None:
    sensor = scene_files.SENSOR.replace(scene_files.TO_WORLD, "")
    lamp = '<emitter type="point"><point name="position" value="1, 2, 3"/></emitter>'
    from_file = import_scene(scene_file(sensor=sensor, emitters=lamp))
    from_dict = import_scene(scene_files.scene_dict())
    from_scene = import_scene(mi.load_dict(scene_files.scene_dict()))
    for other in (from_dict, from_scene):
        np.testing.assert_array_equal(from_file.vertices, other.vertices)
        np.testing.assert_array_equal(from_file.materials, other.materials)
        for name in (
            "shapes",
            "emitters",
            "camera",
            "film",
            "spp",
            "base_seed",
            "warnings",
        ):
            assert getattr(from_file, name) == getattr(other, name), name


def test_dictionary_that_holds_objects(scalar_variant: None) -> None:
    bsdf = mi.load_dict(
        {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.1, 0.2, 0.3]}}
    )
    scene = import_scene(scene_files.scene_dict(floor={"type": "rectangle", "bsdf": bsdf}))
    np.testing.assert_allclose(scene.materials[0, 0], [0.1, 0.2, 0.3], rtol=1e-6)


def test_dictionary_with_an_own_integrator() -> None:
    scene = import_scene(
        scene_files.scene_dict(integrator={"type": "mlrt", "hide_emitters": True})
    )
    assert scene.lighting.integrator == "mlrt"
    assert scene.lighting.hide_emitters


def test_variant_of_the_caller_stays_set(
    scene_file: SceneFile, scalar_variant: None
) -> None:
    mi.set_variant("scalar_spectral")
    try:
        import_scene(scene_file())
        assert mi.variant() == "scalar_spectral"
    finally:
        mi.set_variant("scalar_rgb")


def test_area_light_that_is_declared_apart(scene_file: SceneFile) -> None:
    """It counts once, at the shape that refers to it, as in Mitsuba."""
    declared = (
        '<emitter type="area" id="glow"><rgb name="radiance" value="2, 3, 4"/></emitter>'
    )
    scene = import_scene(
        scene_file(
            emitters=declared,
            shapes=scene_files.FLOOR
            + '<shape type="rectangle" id="panel"><ref id="glow"/></shape>',
        )
    )
    (emitter,) = scene.emitters
    assert emitter.radiance == (2, 3, 4)
    assert emitter.shape == 1
    assert [shape.emitter for shape in scene.shapes] == [NONE, 0]
