"""Small scenes for the renderer's tests, as Mitsuba dicts and as the core's arrays.

The same functions serve the scalar variant, which the arrays are taken from, and the llvm
variant, which renders the references; set one of them before a call.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

SceneDict = dict[str, Any]


def rgb(*value: float) -> SceneDict:
    return {"type": "rgb", "value": list(value)}


def diffuse(*value: float) -> SceneDict:
    return {"type": "diffuse", "reflectance": rgb(*value)}


def transform(*steps: Any) -> Any:
    result = mi.ScalarTransform4f()
    for step in steps:
        result = result @ step
    return result


def translate(*v: float) -> Any:
    return mi.ScalarTransform4f().translate(list(v))


def scale(*v: float) -> Any:
    return mi.ScalarTransform4f().scale(list(v))


def rotate(axis: tuple[float, float, float], degrees: float) -> Any:
    return mi.ScalarTransform4f().rotate(list(axis), degrees)


def look_at(origin: tuple[float, ...], target: tuple[float, ...]) -> Any:
    return mi.ScalarTransform4f().look_at(
        origin=list(origin), target=list(target), up=[0, 1, 0]
    )


def film(width: int = 64, height: int = 48, rfilter: str = "box", **more: Any) -> SceneDict:
    return {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "component_format": "float32",
        "rfilter": {"type": rfilter},
        **more,
    }


def sensor(film_dict: SceneDict, **more: Any) -> SceneDict:
    result = {
        "type": "perspective",
        "fov": 45,
        "to_world": look_at((0.3, 1.2, 4), (0, 0.6, 0)),
        "film": film_dict,
        "sampler": {"type": "independent"},
        **more,
    }
    return {key: value for key, value in result.items() if value is not None}


def write_ball(folder: Path, normals: bool = True) -> str:
    """A ball of radius 0.5, 180 triangles, as a PLY file with or without vertex normals."""
    rings, sectors = 6, 18
    points = [(0.0, 0.5, 0.0)]
    for i in range(1, rings):
        theta = math.pi * i / rings
        for j in range(sectors):
            phi = 2 * math.pi * j / sectors
            points.append(
                (
                    0.5 * math.sin(theta) * math.cos(phi),
                    0.5 * math.cos(theta),
                    0.5 * math.sin(theta) * math.sin(phi),
                )
            )
    points.append((0.0, -0.5, 0.0))

    def vertex(ring: int, sector: int) -> int:
        return 1 + (ring - 1) * sectors + sector % sectors

    last = len(points) - 1
    faces = []
    for j in range(sectors):
        faces.append((0, vertex(1, j + 1), vertex(1, j)))
        faces.append((last, vertex(rings - 1, j), vertex(rings - 1, j + 1)))
        for i in range(1, rings - 1):
            a, b = vertex(i, j), vertex(i, j + 1)
            c, d = vertex(i + 1, j), vertex(i + 1, j + 1)
            faces += [(a, b, c), (b, d, c)]
    lines = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(points)}",
        *(f"property float {name}" for name in "xyz"),
        *(f"property float n{name}" for name in "xyz" if normals),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    for p in points:
        n = tuple(2 * x for x in p) if normals else ()
        lines.append(" ".join(repr(x) for x in (*p, *n)))
    lines += [f"3 {a} {b} {c}" for a, b, c in faces]
    path = folder / f"ball-{'smooth' if normals else 'flat'}.ply"
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def room(folder: Path, **more: Any) -> SceneDict:
    """A floor, a wall, a cube and a smooth ball; no light."""
    return {
        "type": "scene",
        "floor": {
            "type": "rectangle",
            "to_world": transform(rotate((1, 0, 0), -90), scale(3, 3, 1)),
            "bsdf": diffuse(0.6, 0.5, 0.4),
        },
        "wall": {
            "type": "rectangle",
            "to_world": transform(translate(0, 1, -2), scale(3, 2, 1)),
            "bsdf": {"type": "twosided", "bsdf": diffuse(0.2, 0.5, 0.7)},
        },
        "cube": {
            "type": "cube",
            "to_world": transform(
                translate(-0.7, 0.43, 0), rotate((0, 1, 0), 30), scale(0.4, 0.4, 0.4)
            ),
            "bsdf": diffuse(0.8, 0.3, 0.3),
        },
        "ball": {
            "type": "ply",
            "filename": write_ball(folder),
            "to_world": translate(0.6, 0.5, 0.4),
            "bsdf": {"type": "twosided", "bsdf": diffuse(0.3, 0.8, 0.3)},
        },
        "sensor": sensor(film()),
        **more,
    }


def point_light() -> SceneDict:
    return {"type": "point", "position": [1.2, 2.5, 1.5], "intensity": rgb(8, 7, 6)}


def spot_light(**more: Any) -> SceneDict:
    return {
        "type": "spot",
        "to_world": look_at((-1.5, 2.5, 1.5), (0, 0.2, 0)),
        "intensity": rgb(20, 18, 30),
        "cutoff_angle": 25,
        **more,
    }


def directional_light() -> SceneDict:
    return {
        "type": "directional",
        "direction": [-0.4, -1, -0.5],
        "irradiance": rgb(2, 2, 1.5),
    }


def rectangle_light(**more: Any) -> SceneDict:
    return {
        "type": "rectangle",
        "to_world": transform(
            translate(0.2, 2.2, 0.3), rotate((1, 0, 0), 90), scale(0.6, 0.4, 1)
        ),
        "emitter": {"type": "area", "radiance": rgb(6, 6, 5)},
        "bsdf": diffuse(0.1, 0.1, 0.1),
        **more,
    }


def mesh_light(folder: Path, normals: bool) -> SceneDict:
    return {
        "type": "ply",
        "filename": write_ball(folder, normals),
        "to_world": transform(translate(0.9, 1.7, 0.2), scale(0.5, 0.5, 0.5)),
        "emitter": {"type": "area", "radiance": rgb(9, 4, 4)},
    }


def constant_light(**more: Any) -> SceneDict:
    return {"type": "constant", "radiance": rgb(0.6, 0.8, 1.1), **more}


def write_sky(folder: Path, width: int = 24, height: int = 13) -> str:
    """A picture of a sky with a sun, a black ground and a pole brighter than its row."""
    random = np.random.default_rng(5)
    sky = random.uniform(0.1, 0.6, (height, width, 3)).astype(np.float32)
    sky[..., 2] *= 2
    sky[height // 2 + 2 :, : width // 2] = 0
    sky[height // 4, width // 3] = (40, 36, 20)
    sky[0, 2] = 3
    path = folder / f"sky-{width}x{height}.exr"
    if not path.exists():
        mi.Bitmap(sky).write(str(path))
    return str(path)


def sky_light(folder: Path, **more: Any) -> SceneDict:
    return {
        "type": "envmap",
        "filename": write_sky(folder),
        "scale": 1.5,
        "to_world": transform(rotate((0, 1, 0), 130), rotate((1, 0, 0), 15)),
        **more,
    }


def several_lights(folder: Path) -> SceneDict:
    return room(
        folder,
        a=point_light(),
        b=spot_light(sampling_weight=2.5),
        c=directional_light(),
        d=rectangle_light(),
        e=mesh_light(folder, True),
    )


def mirrored(folder: Path) -> SceneDict:
    """Flipped normals, a light whose transform mirrors, and two colours of one sheet."""
    return room(
        folder,
        lamp=rectangle_light(
            to_world=transform(
                translate(0.2, 2.2, 0.3), rotate((1, 0, 0), 90), scale(-0.6, 0.4, 1)
            )
        ),
        back_lamp=rectangle_light(
            to_world=transform(
                translate(-1.6, 1, 0), rotate((0, 1, 0), -90), scale(0.3, 0.3, 1)
            ),
            flip_normals=True,
        ),
        sheet={
            "type": "rectangle",
            "to_world": transform(
                translate(1.6, 0.6, 0.5), rotate((0, 1, 0), 160), scale(0.4, 0.6, 1)
            ),
            "flip_normals": True,
            "bsdf": {
                "type": "twosided",
                "front": diffuse(0.9, 0.1, 0.1),
                "back": diffuse(0.1, 0.1, 0.9),
            },
        },
    )


# Name, what is in it; the folder is for its mesh files.
SCENES: Mapping[str, Callable[[Path], SceneDict]] = {
    "point": lambda folder: room(folder, light=point_light()),
    "spot": lambda folder: room(folder, light=spot_light()),
    "directional": lambda folder: room(folder, light=directional_light()),
    "rectangle": lambda folder: room(folder, light=rectangle_light()),
    "mesh smooth": lambda folder: room(folder, light=mesh_light(folder, True)),
    "mesh flat": lambda folder: room(folder, light=mesh_light(folder, False)),
    "constant": lambda folder: room(folder, light=constant_light()),
    "sky": lambda folder: room(folder, light=sky_light(folder)),
    "large sky": lambda folder: room(
        folder,
        light={"type": "envmap", "filename": write_sky(folder, 300, 151)},
        sensor=sensor(film(), to_world=look_at((0.3, 0.2, 4), (0, 2.6, 0))),
    ),
    "mirrored sky": lambda folder: room(
        folder,
        light=sky_light(folder, to_world=transform(rotate((1, 0, 0), 20), scale(-1, 1, 1))),
        lamp=rectangle_light(),
        sun=directional_light(),
    ),
    "several": several_lights,
    "mirrored": mirrored,
    "gaussian": lambda folder: room(
        folder, light=rectangle_light(), sensor=sensor(film(70, 45, "gaussian"))
    ),
    **{
        name: lambda folder, name=name: room(
            folder, light=rectangle_light(), sensor=sensor(film(41, 30, name))
        )
        for name in ("tent", "mitchell", "catmullrom", "lanczos")
    },
    "gaussian border": lambda folder: room(
        folder,
        light=rectangle_light(),
        sensor=sensor(film(40, 33, "gaussian", sample_border=True)),
    ),
    "crop": lambda folder: room(
        folder,
        light=rectangle_light(),
        sensor=sensor(
            film(
                90,
                70,
                "gaussian",
                crop_offset_x=21,
                crop_offset_y=13,
                crop_width=50,
                crop_height=41,
            )
        ),
    ),
    "lens": lambda folder: room(
        folder,
        light=rectangle_light(),
        sensor=sensor(
            film(70, 45, "gaussian"),
            type="thinlens",
            aperture_radius=0.15,
            focus_distance=3.7,
            near_clip=0.5,
        ),
    ),
    "lens in a crop": lambda folder: room(
        folder,
        light=sky_light(folder),
        sensor=sensor(
            film(70, 45, crop_offset_x=11, crop_offset_y=7, crop_width=40, crop_height=30),
            type="thinlens",
            aperture_radius=0.3,
            focus_distance=4.2,
            fov_axis="y",
        ),
    ),
    "parallel": lambda folder: room(
        folder,
        light=rectangle_light(),
        sensor=sensor(
            film(70, 45),
            type="orthographic",
            fov=None,
            to_world=transform(look_at((0.3, 1.2, 4), (0, 0.6, 0)), scale(2.4, 2.1, 1)),
        ),
    ),
    "parallel along an axis": lambda folder: room(
        folder,
        light=sky_light(folder),
        sensor=sensor(
            film(50, 64, "tent"),
            type="orthographic",
            fov=None,
            to_world=transform(
                translate(0.2, 1.1, 5), rotate((0, 1, 0), 180), scale(2, 2, 3)
            ),
            near_clip=1.3,
            far_clip=4.6,
        ),
    ),
    "offset camera": lambda folder: room(
        folder,
        light=point_light(),
        sensor=sensor(
            film(50, 64),
            principal_point_offset_x=0.12,
            principal_point_offset_y=-0.2,
            fov_axis="y",
            near_clip=3.9,
            far_clip=5.5,
        ),
    ),
}
