"""Scenes of analytic shapes and instances that show textures."""

from __future__ import annotations

from plugin_scenes import LAMP, PANEL, number
from plugin_scenes import scene as any_scene
from texture_scenes import NESTED_BOARD, TURNED, diffuse, image, mask

LIGHTS = PANEL + LAMP + LAMP.replace('x="1.5"', 'x="-2"')
PICTURE = diffuse(image("reflectance", "image.png"))
TURNED_PICTURE = diffuse(image("reflectance", "float.exr", TURNED))
BOARD = diffuse(NESTED_BOARD)
STENCIL = mask(image("opacity", "stencil.png"), PICTURE)
PLACES = {
    "upright": '<rotate x="1" angle="-60"/><scale value="0.6"/>',
    "mirrored": '<scale x="-0.6" y="0.6" z="0.6"/><rotate y="1" angle="40"/>',
}


def placed(shape: str, place: str, x: float, content: str) -> str:
    return (
        f'<shape {shape}<transform name="to_world">{PLACES[place]}'
        f'<translate x="{x}" y="0.8"/></transform>{content}</shape>'
    )


def scene(body: str) -> str:
    return any_scene(body, LIGHTS)


def row(material: str, place: str) -> str:
    return "".join(
        placed(f'type="{plugin}">', place, x, material)
        for plugin, x in (("sphere", -1.6), ("disk", 0), ("cylinder", 1.6))
    )


def group(*shapes: str) -> str:
    copies = "".join(
        placed('type="instance"><ref id="group"/>', place, x, "")
        for place, x in (("upright", -1.2), ("mirrored", 1.2))
    )
    return f'<shape type="shapegroup" id="group">{"".join(shapes)}</shape>{copies}'


SCENES = {
    **{f"picture {place}": scene(row(PICTURE, place)) for place in PLACES},
    "turned picture": scene(row(TURNED_PICTURE, "upright")),
    "checkerboard": scene(row(BOARD, "mirrored")),
    "masks": scene(row(STENCIL, "upright")),
    "half a mask": scene(row(mask(number("opacity", 0.4), BOARD), "mirrored")),
    "group of meshes": scene(
        group(
            f'<shape type="rectangle">{PICTURE}</shape>',
            f'<shape type="cube"><transform name="to_world"><scale value="0.5"/>'
            f'<translate z="0.8"/></transform>{STENCIL}</shape>',
        )
    ),
    "group of objects": scene(
        group(
            f'<shape type="sphere">{BOARD}</shape>',
            f'<shape type="disk"><transform name="to_world"><translate x="1.5"/>'
            f"</transform>{PICTURE}</shape>",
        )
    ),
    "group without coordinates": scene(
        group(
            '<shape type="ply"><string name="filename" value="plain.ply"/>'
            f"{PICTURE}</shape>"
        )
    ),
}
