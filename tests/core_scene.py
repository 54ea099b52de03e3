"""Turns a Mitsuba scene dict into the core's Scene, for the features that the core has.

It knows nothing of the package's importer, so that tests of the core do not rest on it.
Needs the variant scalar_rgb.
"""

from __future__ import annotations

import math
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt

from mlrt_plugin._dispatch import core

Array = npt.NDArray[Any]


def values_of(plugin: Any, ending: str) -> list[list[float]]:
    """Constant colours among a plugin's parameters, in the order of their names."""
    params = dict(mi.traverse(plugin).items())
    return [
        np.broadcast_to(np.array(params[key], np.float64).ravel(), 3).tolist()
        for key in sorted(params)
        if key.endswith(ending)
    ]


def camera_of(sensor: Any) -> dict[str, Any]:
    params = dict(mi.traverse(sensor).items())
    matrix = np.array(sensor.world_transform().matrix, np.float64)
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    near, far = sensor.near_clip(), sensor.far_clip()
    camera = {
        "origin": matrix[:3, 3],
        "axes": (matrix[:3, :3] / lengths).T,
        "near_clip": near,
        "far_clip": far,
    }
    if "x_fov" not in params:
        near *= lengths[2]
        return camera | {
            "type": "orthographic",
            "half_extent": lengths[:2],
            "near_clip": near,
            "far_clip": near + far - sensor.near_clip(),
        }
    camera["tan_half_fov_x"] = math.tan(math.radians(float(params["x_fov"])) / 2)
    if "aperture_radius" in params:
        return camera | {
            "type": "thinlens",
            "aperture_radius": float(params["aperture_radius"]),
            "focus_distance": float(params["focus_distance"]),
        }
    camera["principal_point_offset"] = [
        float(params[f"principal_point_offset_{axis}"]) for axis in "xy"
    ]
    return camera


def film_of(film: Any, description: dict[str, Any]) -> dict[str, Any]:
    rfilter = film.rfilter()
    return {
        "width": int(film.size()[0]),
        "height": int(film.size()[1]),
        "crop_x": int(film.crop_offset()[0]),
        "crop_y": int(film.crop_offset()[1]),
        "crop_width": int(film.crop_size()[0]),
        "crop_height": int(film.crop_size()[1]),
        "filter": description["rfilter"]["type"],
        "filter_radius": float(rfilter.radius()),
        "filter_stddev": float(description["rfilter"].get("stddev", 0.5)),
        "sample_border": bool(description.get("sample_border", False)),
    }


def emitter_of(emitter: Any, kind: str, shape: int | None) -> dict[str, Any]:
    params = mi.traverse(emitter)
    result: dict[str, Any] = {
        "type": kind,
        "sampling_weight": float(params["sampling_weight"]),
    }
    if kind == "constant":
        (result["radiance"],) = values_of(emitter, "radiance.value")
        return result
    if kind == "envmap":
        result["radiance"] = [float(params["scale"])] * 3
        result["axes"] = np.array(params["to_world"].matrix, np.float64)[:3, :3].T
        return result
    if kind == "area":
        (result["radiance"],) = values_of(emitter, "radiance.value")
        result["shape"] = shape
        return result
    colour = "irradiance.value" if kind == "directional" else "intensity.value"
    (result["radiance"],) = values_of(emitter, colour)
    if kind == "point":
        result["position"] = np.array(params["position"]).ravel()
        return result
    matrix = np.array(params["to_world"].matrix, np.float64)
    result["direction"] = matrix[:3, 2]
    if kind == "spot":
        result["position"] = matrix[:3, 3]
        result["cutoff_angle"] = math.radians(float(params["cutoff_angle"]))
        result["beam_width"] = math.radians(float(params["beam_width"]))
    return result


def rectangle_of(mesh: Any) -> dict[str, Any]:
    # Vertices of a rectangle: (u, v) = (0, 0), (1, 0), (0, 1), (1, 1).
    corners = np.array(mesh.vertex_positions_buffer(), np.float32).reshape(4, 3)
    return {
        "rectangle": True,
        "corner": corners[0],
        "edge_u": corners[1] - corners[0],
        "edge_v": corners[2] - corners[0],
    }


def scene_arguments(description: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Arguments of core.Scene for a scene dict; ``more`` replaces some of them."""
    scene = mi.load_dict(description, optimize=False)
    kinds = {
        name: child["type"]
        for name, child in description.items()
        if isinstance(child, dict)
    }
    emitters = list(scene.emitters())
    faces: list[Array] = []
    vertices: list[Array] = []
    normals: list[Array] = []
    shapes, materials = [], []
    emitter_dicts: list[dict[str, Any]] = [
        {} if emitter.id() not in kinds else emitter_of(emitter, kinds[emitter.id()], None)
        for emitter in emitters
    ]
    first_vertex = 0
    for number, mesh in enumerate(scene.shapes()):
        count = mesh.vertex_count()
        own = np.array(mesh.faces_buffer(), np.uint32).reshape(-1, 3)
        shape = {
            "first_face": sum(len(f) for f in faces),
            "face_count": len(own),
            "material": number,
            "emitter": None,
            "vertex_normals": bool(mesh.has_vertex_normals()),
            "flip_normals": bool(description[mesh.id()].get("flip_normals", False)),
        }
        faces.append(own + np.uint32(first_vertex))
        first_vertex += count
        vertices.append(
            np.array(mesh.vertex_positions_buffer(), np.float32).reshape(count, 3)
        )
        given = np.array(mesh.vertex_normals_buffer(), np.float32).reshape(-1, 3)
        normals.append(given if len(given) else np.zeros((count, 3), np.float32))
        sides = values_of(mesh.bsdf(), "reflectance.value")
        two_sided = description[mesh.id()].get("bsdf", {}).get("type") == "twosided"
        materials.append([sides[0], sides[-1] if two_sided else [0.0] * 3])
        if mesh.emitter() is not None:
            index = emitters.index(mesh.emitter())
            shape["emitter"] = index
            emitter_dicts[index] = emitter_of(mesh.emitter(), "area", number)
            if kinds[mesh.id()] == "rectangle":
                emitter_dicts[index] |= rectangle_of(mesh)
        shapes.append(shape)

    all_faces = np.concatenate(faces)
    sensor = scene.sensors()[0]
    arguments: dict[str, Any] = {
        "tree": core.KdTree(np.concatenate(vertices), all_faces),
        "faces": all_faces,
        "normals": np.concatenate(normals),
        "shapes": shapes,
        "materials": np.array(materials, np.float32).reshape(-1, 2, 3),
        "emitters": emitter_dicts,
        "camera": camera_of(sensor),
        "film": film_of(sensor.film(), description["sensor"]["film"]),
        "hide_emitters": False,
    }
    for emitter in emitters:
        if kinds.get(emitter.id()) == "envmap":
            padded = np.array(mi.traverse(emitter)["data"], np.float32)
            arguments["environment"] = padded[:, 1:-1].copy()
    return arguments | more


def core_scene(description: dict[str, Any], **more: Any) -> Any:
    return core.Scene(**scene_arguments(description, **more))
