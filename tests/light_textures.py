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
    "beside a lamp": scene(BALL, LAMP + screen(image("radiance", "float.exr"))),
    "beside itself": scene(
        BALL,
        screen(image("radiance", "float.exr"))
        + screen(image("radiance", "image.png"), '<rotate z="1" angle="180"/>').replace(
            'z="-0.8"', 'z="-2"'
        ),
    ),
}
