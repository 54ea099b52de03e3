"""Scenes with textures and masks, and the files that they refer to."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import mitsuba as mi
import numpy as np
import plugin_assets
import scene_files
from plugin_scenes import LAMP, PANEL, block, bsdf, number, scene, sensor, text, texture

ONLY_LAMP = LAMP + LAMP.replace('x="1.5"', 'x="-2"')
BOARD_ON_FLOOR = """<shape type="rectangle"><transform name="to_world">
<scale value="4"/><rotate x="1" angle="-90"/></transform>{}</shape>"""


def write_assets(folder: Path) -> None:
    plugin_assets.write_assets(folder)
    random = np.random.default_rng(20_050_803)
    rgb = random.random((5, 7, 3), np.float32)
    mi.Bitmap(rgb).write(str(folder / "float.exr"))
    half = mi.Bitmap(rgb).convert(component_format=mi.Struct.Type.Float16)
    half.write(str(folder / "half.exr"))
    grey = (random.random((6, 3, 1)) * 255).astype(np.uint8)
    mi.Bitmap(grey).write(str(folder / "grey.png"))
    mi.Bitmap((rgb[:1, :1] * 255).astype(np.uint8)).write(str(folder / "dot.png"))
    stencil = (random.random((12, 12)) > 0.5).astype(np.uint8) * 255
    mi.Bitmap(stencil[..., None]).write(str(folder / "stencil.png"))
    mi.Bitmap((rgb * 255).astype(np.uint8)).write(str(folder / "stencil-rgb.png"))
    broken = rgb.copy()
    broken[2, 3, 1] = np.nan
    mi.Bitmap(broken).write(str(folder / "nan.exr"))
    (folder / "empty.png").write_bytes(b"")
    (folder / "quad.obj").write_text(QUAD_OBJ)
    (folder / "plain.ply").write_text(plain_ply())
    (folder / "cells.ply").write_text(attribute_ply(face_values=((0.9, 0.2, 0.1),) * 1))
    (folder / "shades.ply").write_text(attribute_ply(vertex_values=(0.1, 0.5, 0.9)))
    (folder / "lost.ply").write_bytes(lost_ply())


QUAD_OBJ = """v -1 0 0.5
v 1 0 0.5
v 1 1.5 0.2
v -1 1.2 0.4
vt -0.7 -0.4
vt 2.3 0.1
vt 1.9 2.6
vt -1.2 1.7
f 1/1 2/2 3/3 4/4
"""


def plain_ply() -> str:
    """Two triangles without texture coordinates."""
    corners = ((-1.0, 0.0, 0.4), (1.0, 0.0, 0.4), (0.8, 1.4, 0.1), (-0.9, 1.1, 0.3))
    lines = ["ply", "format ascii 1.0", "element vertex 4"]
    lines += [f"property float {name}" for name in "xyz"]
    lines += ["element face 2", "property list uchar int vertex_indices", "end_header"]
    lines += [" ".join(str(x) for x in corner) for corner in corners]
    return "\n".join([*lines, "3 0 1 2", "3 0 2 3"]) + "\n"


def lost_ply() -> bytes:
    """A triangle with a texture coordinate that is not a number."""
    lines = ["ply", "format binary_little_endian 1.0", "element vertex 3"]
    lines += [f"property float {name}" for name in ("x", "y", "z", "u", "v")]
    lines += ["element face 1", "property list uchar int vertex_indices", "end_header"]
    rows = [[-1, 0, 0.5, 0, 0], [1, 0, 0.5, 1, np.nan], [0, 1, 0.5, 0, 1]]
    head = "\n".join(lines) + "\n"
    faces = bytes([3]) + np.array([0, 1, 2], "<i4").tobytes()
    return head.encode() + np.array(rows, "<f4").tobytes() + faces


def attribute_ply(
    vertex_values: Sequence[float] = (), face_values: Sequence[Sequence[float]] = ()
) -> str:
    """A triangle with a number for each vertex, or a colour for each face."""
    corners = ((-1.0, 0.0, 0.5), (1.0, 0.0, 0.5), (0.1, 1.4, 0.2))
    lines = ["ply", "format ascii 1.0", "element vertex 3"]
    lines += [f"property float {name}" for name in "xyz"]
    lines += ["property float shade_x"] if vertex_values else []
    lines += ["element face 1", "property list uchar int vertex_indices"]
    lines += [f"property float {name}" for name in "rgb"] if face_values else []
    lines += ["end_header"]
    for corner, value in zip(corners, [*vertex_values, *[None] * 3], strict=False):
        values = corner if value is None else (*corner, value)
        lines.append(" ".join(str(x) for x in values))
    last = ["3 0 1 2", *(str(x) for row in face_values for x in row)]
    return "\n".join([*lines, " ".join(last)]) + "\n"


def matte_living_room(path: Path) -> str:
    """The scene living-room with a lamp in it, its rough materials made diffuse and metals
    smooth; what is left are photographs as textures, and leaves cut out by one."""

    def matte(match: re.Match[str]) -> str:
        colour = re.search(
            r'<texture name="diffuse_reflectance".*?</texture>'
            r'|<(rgb|spectrum) name="diffuse_reflectance"[^>]*/>',
            match.group(0),
            re.DOTALL,
        )
        assert colour is not None
        inside = colour.group(0).replace("diffuse_reflectance", "reflectance")
        return f'<bsdf type="diffuse">{inside}</bsdf>'

    def without(kind: str, plugin: str, text: str) -> str:
        return re.sub(rf'<{kind} type="{plugin}".*?</{kind}>', "", text, flags=re.DOTALL)

    content = path.read_text()
    for name in ("models", "textures"):
        content = content.replace(f'value="{name}/', f'value="{path.parent}/{name}/')
    content = without("emitter", "envmap", without("integrator", "path", content))
    content = re.sub(
        r'<bsdf type="roughplastic">.*?</bsdf>', matte, content, flags=re.DOTALL
    )
    content = content.replace('<bsdf type="roughconductor"', '<bsdf type="conductor"')
    content = re.sub(
        r'(<bsdf type="conductor"[^>]*>).*?</bsdf>',
        r"\1</bsdf>",
        content,
        flags=re.DOTALL,
    )
    for name, size in (("width", 192), ("height", 108)):
        content = re.sub(
            rf'name="{name}" value="[^"]*"', f'name="{name}" value="{size}"', content
        )
    lamp = LAMP.replace('x="1.5" y="4" z="4"', 'x="0" y="2.2" z="0"')
    return content.replace("</scene>", f"{lamp}{DIRECT_WITHOUT}</scene>")


DIRECT_WITHOUT = """<integrator type="direct"><integer name="bsdf_samples" value="0"/>
</integrator>"""


def image(name: str, file: str, more: str = "") -> str:
    return texture(name, "bitmap", text("filename", file) + more)


def to_uv(content: str) -> str:
    return f'<transform name="to_uv">{content}</transform>'


def lookup(filter_type: str, wrap_mode: str) -> str:
    return text("filter_type", filter_type) + text("wrap_mode", wrap_mode)


def mesh(file: str, content: str) -> str:
    return scene_files.mesh_shape(file, content).replace('id="mesh"', "")


def diffuse(reflectance: str) -> str:
    return bsdf("twosided", bsdf("diffuse", reflectance))


def mask(opacity: str, inner: str) -> str:
    return bsdf("mask", opacity + inner)


BOARD = texture("reflectance", "checkerboard", to_uv('<scale x="5" y="3"/>'))
NESTED_BOARD = texture(
    "reflectance",
    "checkerboard",
    to_uv('<rotate z="1" angle="20"/><scale x="3" y="4"/>')
    + image("color0", "image.png")
    + '<rgb name="color1" value="0.1, 0.7, 0.3"/>',
)
TURNED = to_uv(
    '<scale x="2.5" y="-1.5"/><rotate z="1" angle="30"/><translate x="0.3" y="0.1"/>'
)

SCENES = {
    **{
        f"{filter_type} {wrap_mode}": scene(
            mesh(
                "quad.obj",
                diffuse(image("reflectance", "image.png", lookup(filter_type, wrap_mode))),
            ),
            ONLY_LAMP,
        )
        for filter_type in ("bilinear", "nearest")
        for wrap_mode in ("repeat", "mirror", "clamp")
    },
    "images": scene(
        "".join(
            block(bsdf("diffuse", image("reflectance", file, more)), x)
            for x, file, more in (
                (-2.2, "float.exr", TURNED),
                (-1.1, "half.exr", ""),
                (0.0, "grey.png", TURNED),
                (1.1, "image.png", '<boolean name="raw" value="true"/>'),
                (2.2, "dot.png", ""),
            )
        ),
        ONLY_LAMP,
    ),
    "checkerboard": scene(
        block(bsdf("diffuse", NESTED_BOARD), -0.5, "rectangle", 1.0)
        + block(bsdf("diffuse", NESTED_BOARD), 1.4),
        PANEL,
        floor=BOARD_ON_FLOOR.format(bsdf("diffuse", BOARD)),
    ),
    "coordinates": scene(
        mesh("smooth.ply", diffuse(image("reflectance", "image.png", TURNED)))
        + '<shape type="serialized"><string name="filename" value="square.serialized"/>'
        '<transform name="to_world"><translate x="1.2"/></transform>'
        + diffuse(image("reflectance", "image.png"))
        + "</shape>",
        ONLY_LAMP,
    ),
    "without coordinates": scene(
        mesh("plain.ply", diffuse(image("reflectance", "image.png"))), ONLY_LAMP
    ),
    "attributes": scene(
        mesh(
            "coloured.ply",
            diffuse(
                texture(
                    "reflectance",
                    "mesh_attribute",
                    text("name", "vertex_color") + number("scale", 0.8),
                )
            ),
        )
        + "".join(
            mesh(
                file,
                f'<transform name="to_world"><translate x="{x}" z="-0.5"/></transform>'
                + diffuse(texture("reflectance", "mesh_attribute", text("name", name))),
            )
            for file, name, x in (
                ("cells.ply", "face_color", -1.6),
                ("shades.ply", "vertex_shade", 1.5),
            )
        ),
        ONLY_LAMP,
    ),
    "two sides": scene(
        block(
            bsdf(
                "twosided",
                bsdf("diffuse", image("reflectance", "image.png"))
                + bsdf("diffuse", NESTED_BOARD),
            ),
            0,
            "rectangle",
            1.0,
        )
        + '<shape type="rectangle"><boolean name="flip_normals" value="true"/>'
        '<transform name="to_world"><scale value="0.5"/><translate x="1.6" y="0.5"/>'
        "</transform>"
        + bsdf(
            "twosided",
            bsdf("diffuse", image("reflectance", "image.png"))
            + bsdf("diffuse", '<rgb name="reflectance" value="0.1, 0.2, 0.9"/>'),
        )
        + "</shape>",
        ONLY_LAMP,
    ),
    "masks": scene(
        block(mask(number("opacity", 0.3), diffuse("")), -2.2)
        + block(
            mask(
                image("opacity", "stencil.png", '<boolean name="raw" value="true"/>'),
                bsdf("diffuse", image("reflectance", "image.png")),
            ),
            -1.1,
        )
        + block(mask(image("opacity", "stencil-rgb.png"), bsdf("diffuse")), 0)
        + block(
            mask(
                texture("opacity", "checkerboard", number("color0", 0.9)),
                bsdf("diffuse"),
            ),
            1.1,
        )
        + mesh(
            "shades.ply",
            mask(
                texture("opacity", "mesh_attribute", text("name", "vertex_shade")),
                diffuse(""),
            ),
        ),
        ONLY_LAMP,
    ),
    "black materials": scene(
        block(bsdf("conductor", text("material", "Au")), -2.2)
        + block(bsdf("dielectric"), -1.1)
        + block(bsdf("thindielectric"), 0)
        + block(bsdf("null"), 1.1)
        + block(bsdf("twosided", bsdf("conductor") + bsdf("diffuse")), 2.2, "rectangle"),
        ONLY_LAMP,
    ),
    "wide filter": scene(
        block(bsdf("diffuse", image("reflectance", "image.png"))),
        PANEL,
        eye=sensor(rfilter="gaussian"),
    ),
}
