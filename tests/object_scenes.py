"""Scenes of analytic shapes and instances, as dicts that `mi.load_dict` takes.

Each is a function of no arguments, since transforms belong to the variant that is set.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mitsuba as mi

Scene = dict[str, Any]


def moved() -> Any:
    return mi.ScalarTransform4f()  # type: ignore[attr-defined]


def diffuse(*colour: float) -> Scene:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(colour)}}


def glowing(radiance: float) -> Scene:
    return {"type": "area", "radiance": {"type": "rgb", "value": [radiance] * 3}}


RED = diffuse(0.8, 0.2, 0.2)
BLUE = {"type": "twosided", "bsdf": diffuse(0.3, 0.5, 0.8)}
POINT = {
    "type": "point",
    "position": [2, 4, 3],
    "intensity": {"type": "rgb", "value": [30, 30, 30]},
}
SUN = {
    "type": "directional",
    "direction": [0.3, -1, -0.2],
    "irradiance": {"type": "rgb", "value": [3, 3, 3]},
}
BALL = {"type": "sphere", "center": [0, 0.5, 0], "radius": 0.5, "bsdf": RED}


def scene(**parts: Scene) -> Scene:
    """A scene with a floor unless that is given as an empty dict."""
    floor = {
        "type": "rectangle",
        "to_world": moved().rotate([1, 0, 0], -90).scale(4),
        "bsdf": diffuse(0.7, 0.7, 0.7),
    }
    sensor = {
        "type": "perspective",
        "fov": 45,
        "to_world": moved().look_at([0, 2, 6], [0, 0.6, 0], [0, 1, 0]),
        "film": {
            "type": "hdrfilm",
            "width": 96,
            "height": 96,
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent", "sample_count": 4},
    }
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    given = {"sensor": sensor, "integrator": integrator, "floor": floor, **parts}
    return {"type": "scene", **{name: part for name, part in given.items() if part}}


def shapes() -> Scene:
    return scene(
        ball={
            "type": "sphere",
            "to_world": moved().translate([-1.2, 0.7, 0]).scale([0.7, 0.5, 0.7]),
            "bsdf": RED,
        },
        disk={
            "type": "disk",
            "to_world": moved()
            .translate([1.3, 1, 0])
            .rotate([0, 1, 0], -30)
            .rotate([1, 0, 0], 20)
            .scale([0.9, 0.5, 1]),
            "bsdf": BLUE,
        },
        back={
            "type": "disk",
            "to_world": moved().translate([0, 2, -1]).scale([0.5, 0.5, 1]),
            "flip_normals": True,
            "bsdf": RED,
        },
        tube={
            "type": "cylinder",
            "p0": [-0.2, 0, 0.5],
            "p1": [0.3, 1.4, 0.3],
            "radius": 0.3,
            "bsdf": BLUE,
        },
        inside={
            "type": "cylinder",
            "to_world": moved()
            .translate([1.2, 0.2, 1.5])
            .rotate([0, 1, 0], 60)
            .scale([0.2, 0.4, 0.8]),
            "flip_normals": True,
            "bsdf": RED,
        },
        room={
            "type": "sphere",
            "center": [0, 2, 0],
            "radius": -12,
            "bsdf": RED,
        },
        light=POINT,
    )


def sphere_light() -> Scene:
    lamp = {"type": "sphere", "center": [1.5, 2.5, 1], "radius": 0.4}
    return scene(lamp={**lamp, "emitter": glowing(20)}, ball=BALL)


def distant_sphere_light() -> Scene:
    lamp = {"type": "sphere", "center": [40, 60, 30], "radius": 0.6}
    return scene(lamp={**lamp, "emitter": glowing(3e4)}, ball=BALL)


def inside_sphere_light() -> Scene:
    sky = {"type": "sphere", "center": [0, 2, 0], "radius": 12, "flip_normals": True}
    return scene(sky={**sky, "emitter": glowing(1)}, ball=BALL)


def disk_light() -> Scene:
    place = moved().translate([0, 3, 0]).rotate([1, 0, 0], 90).scale([1, 0.6, 1])
    return scene(lamp={"type": "disk", "to_world": place, "emitter": glowing(8)}, ball=BALL)


def cylinder_light() -> Scene:
    lamp = {"type": "cylinder", "p0": [-2, 2.5, 0], "p1": [2, 2.5, 0.5], "radius": 0.1}
    return scene(lamp={**lamp, "emitter": glowing(20)}, ball=BALL, light=POINT)


def instances() -> Scene:
    def placed(place: Any) -> Scene:
        return {
            "type": "instance",
            "to_world": place,
            "group": {"type": "ref", "id": "group"},
        }

    return scene(
        group={
            "type": "shapegroup",
            "cube": {"type": "cube", "to_world": moved().scale(0.3), "bsdf": BLUE},
            "ball": {**BALL, "radius": 0.2},
        },
        one=placed(moved().translate([-1, 0.5, 0]).rotate([0, 1, 0], 30)),
        mirrored=placed(
            moved().translate([1, 0.5, 0]).rotate([1, 1, 0], 30).scale([1, -1, 2])
        ),
        flat=placed(moved().translate([0, 1.5, -1]).scale([2, 0.5, 1])),
        light=POINT,
    )


def without_meshes() -> Scene:
    ground = {"type": "disk", "to_world": moved().rotate([1, 0, 0], -90).scale(3)}
    return scene(floor={}, ground={**ground, "bsdf": RED}, ball=BALL, light=SUN)


SCENES: dict[str, Callable[[], Scene]] = {
    function.__name__.replace("_", " "): function
    for function in (
        *(shapes, sphere_light, distant_sphere_light, inside_sphere_light),
        *(disk_light, cylinder_light, instances, without_meshes),
    )
}
