"""Scenes with area lights that show textures."""

from __future__ import annotations

from plugin_scenes import LAMP, block, bsdf, texture
from plugin_scenes import scene as any_scene
from texture_scenes import DIRECT_WITHOUT, NESTED_BOARD, TURNED, image, lookup, to_uv

STEPPED_BOARD = NESTED_BOARD.replace('name="reflectance"', 'name="radiance"')


def screen(radiance: str, move: str = "", more: str = "") -> str:
    """A rectangle above the floor that glows towards it and the camera."""
    return (
        f'<shape type="rectangle"><transform name="to_world">{move}<scale x="1.5" y="0.8"/>'
        '<rotate x="1" angle="35"/><translate y="1.6" z="-0.8"/></transform>'
        f'{more}<emitter type="area">{radiance}</emitter></shape>'
    )


def round_light(plugin: str, radiance: str, move: str, more: str = "") -> str:
    """A sphere, disk or cylinder that shows a texture to the floor and the camera."""
    return (
        f'<shape type="{plugin}"><transform name="to_world">{move}</transform>'
        f'{more}<emitter type="area">{radiance}</emitter></shape>'
    )


FLIPPED = '<boolean name="flip_normals" value="true"/>'
BOARD = texture("radiance", "checkerboard", to_uv('<scale x="6" y="4"/>'))


def scene(body: str, lights: str) -> str:
    return any_scene(body, lights, integrator=DIRECT_WITHOUT)


BALL = block(bsdf("diffuse"), 0.3)
SCENES = {
    **{
        f"{filter_type} {wrap_mode}": scene(
            BALL, screen(image("radiance", "image.png", lookup(filter_type, wrap_mode)))
        )
        for filter_type in ("bilinear", "nearest")
        for wrap_mode in ("repeat", "mirror", "clamp")
    },
    "half floats": scene(BALL, screen(image("radiance", "half.exr"))),
    "grey": scene(BALL, screen(image("radiance", "grey.png", lookup("nearest", "clamp")))),
    "one texel": scene(BALL, screen(image("radiance", "dot.png"))),
    # Black texels are never chosen, and those beside them only for their edges.
    "stencil": scene(BALL, screen(image("radiance", "stencil.png"))),
    "turned": scene(BALL, screen(image("radiance", "image.png", TURNED))),
    "checkerboard": scene(
        BALL, screen(texture("radiance", "checkerboard", to_uv('<scale x="5" y="3"/>')))
    ),
    "nested checkerboard": scene(BALL, screen(STEPPED_BOARD)),
    **{
        f"{name}{kind}": scene(BALL, round_light(plugin, radiance, move, more))
        for kind, radiance in (
            ("", image("radiance", "image.png")),
            (" of half floats", image("radiance", "half.exr", TURNED)),
        )
        for name, plugin, move, more in (
            (
                "sphere",
                "sphere",
                '<scale value="0.7"/><translate x="0.4" y="2" z="-0.5"/>',
                "",
            ),
            ("within a sphere", "sphere", '<scale value="8"/>', FLIPPED),
            (
                "disk",
                "disk",
                '<scale x="1.4" y="0.9"/><rotate x="1" angle="50"/><translate y="1.8"/>',
                "",
            ),
            (
                "flipped disk",
                "disk",
                '<rotate x="0.8" y="0.6" angle="220"/><translate y="1.8" z="-0.6"/>',
                FLIPPED,
            ),
            (
                "cylinder",
                "cylinder",
                '<scale x="0.4" y="0.4" z="1.5"/><translate x="-0.3" y="2.1" z="-1.2"/>',
                "",
            ),
            ("within a cylinder", "cylinder", '<scale x="6" y="6" z="9"/>', FLIPPED),
        )
    },
    "checkerboard on a sphere": scene(
        BALL, round_light("sphere", BOARD, '<translate y="2.4" z="-1"/>')
    ),
    "beside a lamp": scene(BALL, LAMP + screen(image("radiance", "float.exr"))),
    "beside itself": scene(
        BALL,
        screen(image("radiance", "float.exr"))
        + screen(image("radiance", "image.png"), '<rotate z="1" angle="180"/>').replace(
            'z="-0.8"', 'z="-2"'
        ),
    ),
}
