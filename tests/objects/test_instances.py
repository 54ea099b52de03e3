"""Instances: hits in them, what their indices tell, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import object_scenes
import pytest
import scene_files
from object_sets import closest, object_set
from oracles import Soup

import mlrt_plugin
from mlrt_plugin import SceneError, scene_objects
from mlrt_plugin._dispatch import core
from mlrt_plugin.parsing import instantiate
from mlrt_plugin.scene_import import parse

Array = npt.NDArray[Any]


def mesh_group(rng: np.random.Generator) -> tuple[dict[str, Any], Soup]:
    vertices = rng.uniform(-1, 1, (30, 3)).astype(np.float32)
    faces = rng.permutation(30).reshape(10, 3).astype(np.uint32)
    group = {
        "tree": core.KdTree(vertices, faces),
        "faces": faces[:0],
        "normals": np.zeros((0, 3), np.float32),
        "analytic_count": 0,
    }
    return group, Soup(vertices, faces)


@pytest.mark.parametrize("mirrored", [False, True])
def test_hits_are_exact_in_the_frame_of_the_group(mirrored: bool) -> None:
    """The ray is rounded once, in the frame of the group, and met exactly there."""
    seed = 5
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    group, soup = mesh_group(rng)
    linear = rng.normal(size=(3, 3)) * np.array([1, 0.2, 3])
    if (np.linalg.det(linear) < 0) != mirrored:
        linear = -linear
    map_ = np.concatenate([linear, rng.normal(size=(3, 1)) * 10], axis=1)
    objects = object_set([], [], [group], instance_groups=[0], maps=[map_])
    goals = rng.uniform(-0.6, 0.6, (400, 3)) @ linear.T + map_[:, 3]
    origins = (rng.normal(size=(400, 3)) * 30).astype(np.float32)
    directions = (goals - origins).astype(np.float32)
    t, face, instance = closest(objects, origins, directions)

    inverse = np.linalg.inv(linear)
    local = [
        ((origins - map_[:, 3]) @ inverse.T).astype(np.float32),
        (directions @ inverse.T).astype(np.float32),
    ]
    expected = soup.hits(*local)
    # NumPy's inverse may round a coordinate the other way than the core's.
    same = [
        (hit is None and not math.isfinite(distance))
        or (hit is not None and number in hit.faces)
        for hit, distance, number in zip(expected, t, face, strict=True)
    ]
    assert np.mean(same) > 0.995
    for hit, distance in zip(expected, t, strict=True):
        if hit is not None and math.isfinite(distance):
            assert abs(distance - hit.t) <= 1e-5 * abs(hit.t)
    assert np.mean(instance == 0) > 0.3
    np.testing.assert_array_equal(instance >= 0, face >= 0)


def test_hundred_thousand_instances() -> None:
    """A sphere, 100,000 times: against all of them, in NumPy."""
    seed, count = 7, 100_000
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    centres = rng.uniform(-100, 100, (count, 3))
    radii = rng.uniform(0.1, 1, count)
    maps = np.zeros((count, 3, 4))
    maps[:, range(3), range(3)] = radii[:, None] * np.array([1, -1, 1])
    maps[:, :, 3] = centres
    group = {
        "tree": None,
        "faces": np.zeros((0, 3), np.uint32),
        "normals": np.zeros((0, 3), np.float32),
        "analytic_count": 1,
    }
    objects = object_set(
        [0],
        [np.eye(3, 4)],
        [group],
        instance_groups=np.zeros(count),
        maps=maps,
        scene_count=0,
    )
    origins = rng.uniform(-100, 100, (100, 3)).astype(np.float32)
    directions = rng.normal(size=(100, 3)).astype(np.float32)
    t, face, instance = closest(objects, origins, directions)
    for o, d, found, number in zip(origins, directions, t, instance, strict=True):
        f = o - centres
        a, b = d.astype(float) @ d, -(f @ d)
        rest = radii**2 - ((f + (b / a)[:, None] * d) ** 2).sum(axis=1)
        half = np.sqrt(np.where(rest >= 0, rest * a, np.nan))
        both = np.stack([b - half, b + half]) / a
        nearest = np.where(both > 0, both, np.inf).min(axis=0)
        nearest[np.isnan(nearest)] = np.inf
        best = int(np.argmin(nearest))
        if np.isfinite(nearest[best]):
            assert number == best
            assert abs(found - nearest[best]) < 1e-5 * nearest[best]
        else:
            assert number == -1
    assert 0.3 < np.mean(face == 0) < 1


def test_indices_of_a_scene() -> None:
    """Shape, face in it and instance of what three rays hit in a scene."""
    scene = mlrt_plugin.prepare(object_scenes.instances())
    assert isinstance(scene, mlrt_plugin.PreparedScene)
    origins = [[2.5, 9, 2], [-1, 9, 0], [-1, 1.0, 9], [9, 9, 9]]
    directions = [[0, -1, 0], [0, -1, 0], [0, 0, -1], [1, 0, 0]]
    hits = scene.closest_hit(origins, directions)
    names = [scene.shape_names[n] if n >= 0 else "" for n in hits.shape]
    assert ["floor" in names[0], "ball" in names[1], "ball" in names[2]] == [True] * 3
    assert hits.shape[3] == hits.face[3] == hits.instance[3] == -1
    assert hits.instance.tolist() == [-1, 0, 0, -1]
    assert hits.face.tolist()[1:3] == [0, 0] and hits.face[0] in (0, 1)
    np.testing.assert_allclose(hits.t[:3], [9, 7.8, 8.8], rtol=1e-6)
    hidden = scene.any_hit(origins, directions)
    assert hidden.tolist() == [True, True, True, False]
    # The interval of a ray ends before what it would hit.
    assert not scene.any_hit(origins, directions, t_max=7).any()


GROUP = '<shape type="shapegroup" id="group"><shape type="sphere"/></shape>'


def refused(scene_file: Any, shapes: str) -> str:
    with pytest.raises(SceneError) as error:
        mlrt_plugin.prepare(scene_file(shapes=shapes), shading="native")
    return str(error.value)


def test_singular_to_world_is_refused(scene_file: Any) -> None:
    text = refused(
        scene_file,
        GROUP + '<shape type="instance"><ref id="group"/><transform name="to_world">'
        '<scale x="0"/></transform></shape>',
    )
    assert "shape 'instance'" in text and "singular" in text and "scene.xml line" in text


@pytest.mark.parametrize(
    "shape",
    [
        '<shape type="sphere"><float name="radius" value="0"/></shape>',
        '<shape type="cylinder"><float name="radius" value="0"/></shape>',
        '<shape type="cylinder"><point name="p1" value="0, 0, 0"/></shape>',
    ],
)
def test_shape_without_extent_is_refused(scene_file: Any, shape: str) -> None:
    text = refused(scene_file, shape)
    assert "scene.xml line" in text and "must not be 0" in text


def test_nested_groups_are_refused(scene_file: Any) -> None:
    inner = '<shape type="instance"><ref id="group"/></shape>'
    outer = f'<shape type="shapegroup" id="outer">{inner}</shape>'
    text = refused(
        scene_file, GROUP + outer + '<shape type="instance"><ref id="outer"/></shape>'
    )
    assert "Nested instancing is not permitted" in text


def test_lights_in_groups_are_refused(scene_file: Any) -> None:
    text = refused(
        scene_file,
        '<shape type="shapegroup" id="lamps"><shape type="sphere"><emitter type="area"/>'
        '</shape></shape><shape type="instance"><ref id="lamps"/></shape>',
    )
    assert "Instancing of emitters is not supported" in text


def test_ellipsoids_are_told_of(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(
        scene_files.scene_xml(
            shapes='<shape type="sphere" id="egg"><transform name="to_world">'
            '<scale x="2" y="1" z="1"/></transform></shape>'
        )
    )
    scene = mlrt_plugin.prepare(path, shading="native")
    assert any("'egg'" in text and "ellipsoid" in text for text in scene.warnings)


MOVED = '<transform name="to_world"><translate x="{}"/></transform>'


@pytest.mark.parametrize("shading", ["native", "mitsuba"])
@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ('<ref id="group"/><float name="speed" value="1"/>', "unreferenced property"),
        ('<ref id="group"/><bsdf type="diffuse"/>', "Only a shapegroup can be specified"),
        ('<ref id="group"/><ref id="other"/>', "Only a single shapegroup"),
        ("", "'shapegroup' must be specified"),
    ],
)
def test_instances_that_say_more_are_refused(
    scene_file: Any, shading: str, content: str, complaint: str
) -> None:
    other = '<shape type="shapegroup" id="other"><shape type="cube"/></shape>'
    shapes = GROUP + other + f'<shape type="instance">{content}</shape>'
    with pytest.raises(SceneError, match=complaint) as error:
        mlrt_plugin.prepare(scene_file(shapes=shapes), shading=shading)
    assert "instance" in str(error.value) and str(error.value).count("\n") == 0


def test_instances_are_not_loaded_one_by_one(scene_file: Any) -> None:
    """Mitsuba loads none of a scene that only moves groups, and the places are right."""
    many = "".join(
        f'<shape type="instance"><ref id="group"/>{MOVED.format(x)}</shape>'
        for x in range(50)
    )
    path = scene_file(shapes=scene_files.FLOOR + many + GROUP)
    parsed = parse(path, None)
    names = scene_objects.plain_instances(parsed)
    parts, _ = instantiate(parsed, names)
    assert len(names) == 50
    assert not any(part.class_name() == "Instance" for part in parts)
    scene = mlrt_plugin.prepare(path, shading="native")
    assert isinstance(scene, mlrt_plugin.PreparedScene)
    origins = [[x + 0.25, 9, 0] for x in (0, 3, 49)]
    hits = scene.closest_hit(origins, [[0, -1, 0]] * 3)
    assert hits.instance.tolist() == [0, 3, 49]
