"""The building and the dragon, at small sizes, are what their generators promise."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

SCENES = Path(__file__).resolve().parents[2] / "scenes"
SIZES = {"building": 62_000, "dragon": 30_000}
BIGGER = {"building": 130_000, "dragon": 100_000}
FACE = np.dtype([("corners", "u1"), ("indices", "<i4", 3)])

Points = NDArray[np.float64]
Indices = NDArray[np.int32]


def generate(scene: str, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCENES / scene / "generate.py"), *arguments]
    return subprocess.run(
        [*command, "-o", str(folder)], capture_output=True, text=True, timeout=300
    )


def files(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def mesh(data: bytes) -> tuple[Points, Indices]:
    """Vertices (n, 3) and faces (m, 3) of a binary little-endian PLY file."""
    head, body = data.split(b"end_header\n", 1)
    assert b"format binary_little_endian 1.0" in head
    counts = [int(n) for n in re.findall(rb"element \w+ (\d+)", head)]
    points = np.frombuffer(body, "<f4", 3 * counts[0]).reshape(-1, 3)
    faces = np.frombuffer(body, FACE, counts[1], offset=12 * counts[0])
    assert len(body) == 12 * counts[0] + FACE.itemsize * counts[1]
    assert (faces["corners"] == 3).all()
    return points.astype(np.float64), faces["indices"]


def meshes(folder: Path) -> dict[str, tuple[Points, Indices]]:
    return {path.stem: mesh(path.read_bytes()) for path in folder.glob("meshes/*.ply")}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folders = {}
    for scene, size in SIZES.items():
        folders[scene] = tmp_path_factory.mktemp(scene)
        run = generate(scene, folders[scene], "--triangles", str(size))
        assert run.returncode == 0, run.stderr
    return folders


@pytest.mark.parametrize("scene", SIZES)
def test_same_bytes_again(scene: str, made: dict[str, Path], tmp_path: Path) -> None:
    run = generate(scene, tmp_path, "--triangles", str(SIZES[scene]))
    assert run.returncode == 0, run.stderr
    assert files(tmp_path) == files(made[scene])


@pytest.mark.parametrize("scene", SIZES)
def test_another_seed_is_another_scene(
    scene: str, made: dict[str, Path], tmp_path: Path
) -> None:
    run = generate(scene, tmp_path, "--triangles", str(SIZES[scene]), "--seed", "2")
    assert run.returncode == 0, run.stderr
    assert files(tmp_path).keys() == files(made[scene]).keys()
    assert files(tmp_path) != files(made[scene])


@pytest.mark.parametrize("scene", SIZES)
def test_only_whole_files_are_left(scene: str, made: dict[str, Path]) -> None:
    names = files(made[scene])
    assert f"{scene}.xml" in names
    meshes_named = set(re.findall(rb"meshes/\w+\.ply", names[f"{scene}.xml"]))
    assert {name.encode() for name in names} == meshes_named | {f"{scene}.xml".encode()}


@pytest.mark.parametrize("scene", SIZES)
def test_number_of_triangles_is_near_the_one_asked_for(
    scene: str, made: dict[str, Path], tmp_path: Path
) -> None:
    run = generate(scene, tmp_path, "--triangles", str(BIGGER[scene]))
    assert run.returncode == 0, run.stderr
    for folder, asked in ((made[scene], SIZES[scene]), (tmp_path, BIGGER[scene])):
        total = sum(len(faces) for _, faces in meshes(folder).values())
        assert total == pytest.approx(asked, rel=0.02)
    assert f"{total} triangles" in run.stdout


@pytest.mark.parametrize("scene", SIZES)
def test_triangles_have_area(scene: str, made: dict[str, Path]) -> None:
    for name, (points, faces) in meshes(made[scene]).items():
        assert np.isfinite(points).all(), name
        assert faces.min() >= 0, name
        assert faces.max() < len(points), name
        a, b, c = (points[faces[:, i]] for i in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        assert (area > 0).all(), f"{name}: {np.flatnonzero(area == 0)[:5]}"


def test_dragon_is_closed(made: dict[str, Path]) -> None:
    points, faces = meshes(made["dragon"])["skin"]
    assert len(np.unique(points, axis=0)) == len(points)
    assert np.array_equal(np.unique(faces), np.arange(len(points)))
    edges = np.concatenate([faces[:, [i, (i + 1) % 3]] for i in range(3)]).astype(np.int64)
    key = np.unique(edges[:, 0] * len(points) + edges[:, 1])
    assert len(key) == len(edges), "a directed edge belongs to two faces"
    opposite = np.unique(edges[:, 1] * len(points) + edges[:, 0])
    assert np.array_equal(key, opposite), "an edge has one face only"
    # Euler's formula for a surface without handles.
    assert len(points) - len(edges) // 2 + len(faces) == 2


def test_dragon_faces_outward_and_stands_on_the_ground(made: dict[str, Path]) -> None:
    points, faces = meshes(made["dragon"])["skin"]
    a, b, c = (points[faces[:, i]] for i in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert volume > 0.5
    assert -0.15 < points[:, 2].min() < 0.02
    assert points[:, 2].max() > 2


@pytest.fixture(scope="module")
def storeys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A building of more than one storey."""
    folder = tmp_path_factory.mktemp("storeys")
    run = generate("building", folder, "--triangles", "300000")
    assert run.returncode == 0, run.stderr
    return folder / "building.xml"


@pytest.fixture
def building(storeys: Path, scalar_variant: None) -> mi.Scene:
    return mi.load_file(str(storeys))


# A bay is 4 m wide, a storey 3.15 m high; corridors are 2.4 m wide and run along y = 0.
BAY, STOREY, CORRIDOR = 4.0, 3.15, 2.4


def rooms(scene: mi.Scene) -> Points:
    """A point in every room, under the ceiling and above furniture and doors: (storeys,
    bays, 2, 3)."""
    low, high = (
        np.array(v, dtype=np.float64) for v in (scene.bbox().min, scene.bbox().max)
    )
    bays = round((high[0] - low[0] - 0.5) / BAY)
    count = round((high[2] - 0.3) / STOREY)
    assert bays >= 2 and count >= 2
    points = np.empty((count, bays, 2, 3))
    points[..., 0] = (np.arange(bays)[None, :, None] + 0.5) * BAY + 1.0
    points[..., 1] = np.array([-3.9, 3.9])
    points[..., 2] = np.arange(count)[:, None, None] * STOREY + 2.62
    return points


def first_hit(scene: mi.Scene, origin: Points, target: Points) -> str | None:
    """Name of the shape between two points, None if there is none."""
    way = target - origin
    length = float(np.linalg.norm(way))
    ray = mi.Ray3f(mi.Point3f(*origin), mi.Vector3f(*(way / length)), length, 0, [])
    hit = scene.ray_intersect(ray)
    return hit.shape.id() if hit.is_valid() else None


def test_rooms_are_apart(building: mi.Scene) -> None:
    inside = rooms(building)
    pairs = [
        *zip(inside[:, :-1].reshape(-1, 3), inside[:, 1:].reshape(-1, 3), strict=True),
        *zip(inside[:, :, 0].reshape(-1, 3), inside[:, :, 1].reshape(-1, 3), strict=True),
    ]
    assert {first_hit(building, a, b) for a, b in pairs} == {"wall-mesh"}
    above = zip(inside[:-1].reshape(-1, 3), inside[1:].reshape(-1, 3), strict=True)
    assert {first_hit(building, a, b) for a, b in above} == {"ceiling-mesh"}


def test_rooms_are_hollow(building: mi.Scene) -> None:
    for point in rooms(building).reshape(-1, 3):
        assert first_hit(building, point, point - [1.5, 0, 0]) is None
        # The way down ends on what stands there or on the floor, not below it.
        assert first_hit(building, point, point - [0, 0, 2.63]) is not None


def test_camera_of_the_building_sees_a_few_rooms(building: mi.Scene) -> None:
    number = rooms(building)[..., 0].size
    sensor = building.sensors()[0]
    seen = set()
    for x in np.linspace(0.01, 0.99, 40):
        for y in np.linspace(0.01, 0.99, 40):
            ray, _ = sensor.sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
            hit = building.ray_intersect(ray)
            assert hit.is_valid(), f"the building is open at ({x}, {y}) of the picture"
            # Half the thickness of a wall more, so that walls belong to the corridor.
            x_hit, y_hit, z_hit = np.array(hit.p)
            if abs(y_hit) > CORRIDOR / 2 + 0.2:
                seen.add((z_hit // STOREY, x_hit // BAY, y_hit > 0))
    assert 2 <= len(seen) <= 4 < number


@pytest.mark.parametrize("scene", SIZES)
def test_pictures_are_lit(scene: str, made: dict[str, Path], scalar_variant: None) -> None:
    path = made[scene] / f"{scene}.xml"
    loaded = mi.load_file(str(path), resx=24, resy=24, spp=4)
    image = np.array(mi.render(loaded))
    assert image.shape[:2] == (24, 24)
    assert np.isfinite(image).all()
    assert (image.max(axis=2) > 0.01).mean() > 0.5
    # Shadows, too: not everything is equally lit.
    assert image.std() > 0.02


def test_dragon_fills_the_picture_and_shades_itself(
    made: dict[str, Path], scalar_variant: None
) -> None:
    scene = mi.load_file(str(made["dragon"] / "dragon.xml"))
    lamp = mi.traverse(scene.emitters()[0])["position"]
    sensor = scene.sensors()[0]
    hits = shaded = 0
    steps = np.linspace(0.02, 0.98, 32)
    for x in steps:
        for y in steps:
            ray, _ = sensor.sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
            hit = scene.ray_intersect(ray)
            if hit.is_valid() and hit.shape.id() == "skin-mesh":
                hits += 1
                blocker = scene.ray_intersect(hit.spawn_ray_to(lamp))
                shaded += blocker.is_valid() and blocker.shape.id() == "skin-mesh"
    assert hits > 0.25 * len(steps) ** 2
    assert 0.1 * hits < shaded < 0.9 * hits


@pytest.mark.parametrize("scene", SIZES)
@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--triangles", "0"], "number of triangles is a whole number from"),
        (["--triangles", "-5"], "number of triangles is a whole number from"),
        (["--triangles", "many"], "not 'many'"),
        (["--triangles", "1e6"], "not '1e6'"),
        (["--triangles", "99999999999"], "number of triangles is a whole number from"),
        (["--seed", "-1"], "the seed is a whole number from"),
        (["--seed", "x"], "the seed is a whole number from"),
    ],
)
def test_bad_parameters(
    scene: str, arguments: list[str], sentence: str, tmp_path: Path
) -> None:
    run = generate(scene, tmp_path, *arguments)
    assert run.returncode == 2
    assert sentence in run.stderr.splitlines()[-1]
    assert "Traceback" not in run.stderr
    assert files(tmp_path) == {}


@pytest.mark.parametrize("scene", SIZES)
def test_folder_that_cannot_be_written(scene: str, tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    run = generate(scene, blocked, "--triangles", str(SIZES[scene]))
    assert run.returncode == 1
    assert "cannot write into" in run.stderr
    assert len(run.stderr.splitlines()) == 1
    assert blocked.read_text() == "in the way"
