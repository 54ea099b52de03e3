"""Scenes whose mirrors and glass show what glows."""

from __future__ import annotations

from plugin_scenes import (
    LAMP,
    PANEL,
    block,
    bsdf,
    colour,
    number,
    row_of_materials,
    scene,
    sensor,
    text,
    texture,
)

SKY = '<emitter type="constant"><rgb name="radiance" value="0.3, 0.4, 0.6"/></emitter>'
WALLS = "".join(
    f'<shape type="{plugin}"><transform name="to_world"><scale value="0.8"/>'
    f'<translate x="{x}" y="1.5" z="{z}"/></transform><emitter type="area">'
    f'<rgb name="radiance" value="{radiance}"/></emitter></shape>'
    for plugin, x, z, radiance in (
        ("cube", -3, 3, "2, 1, 0.5"),
        ("sphere", 3, 3.5, "0.5, 1, 2"),
        ("disk", 0, -3, "1, 2, 1"),
    )
)
"""Lights of several shapes, around what is in the middle."""
METALS = (
    bsdf("conductor"),
    bsdf("conductor", text("material", "Au")),
    bsdf("conductor", number("eta", 1.5) + colour("k", "2, 3, 4") + colour(
        "specular_reflectance", "0.9, 0.5, 0.2")),
    bsdf("twosided", bsdf("conductor", text("material", "Cu")) + bsdf("diffuse")),
    bsdf("twosided", bsdf("diffuse") + bsdf("conductor")),
)  # fmt: skip
GLASS = (
    bsdf("dielectric"),
    bsdf("dielectric", text("int_ior", "diamond") + number("specular_reflectance", 0.7)),
    bsdf("dielectric", number("int_ior", 1.2) + number("ext_ior", 1.6)),
    bsdf("thindielectric", colour("specular_transmittance", "0.9, 0.5, 0.2")),
    bsdf("dielectric", number("int_ior", 1.3) + number("ext_ior", 1.3)),
)
MASKED = tuple(
    bsdf("mask", number("opacity", 0.4) + inner)
    for inner in (bsdf("conductor"), bsdf("dielectric"), bsdf("thindielectric"))
)
BOARD = (
    colour("color0", "0.9, 0.5, 0.2")
    + number("color1", 0.1)
    + '<transform name="to_uv"><scale x="3" y="2"/></transform>'
)
TEXTURED = (
    bsdf("conductor", texture("specular_reflectance", "checkerboard", BOARD)),
    bsdf(
        "twosided",
        bsdf("conductor", texture("specular_reflectance", "checkerboard", BOARD))
        + bsdf("diffuse"),
    ),
    bsdf(
        "dielectric",
        texture("specular_reflectance", "checkerboard", BOARD)
        + texture("specular_transmittance", "checkerboard", BOARD),
    ),
    bsdf("thindielectric", texture("specular_transmittance", "checkerboard", BOARD)),
    bsdf(
        "mask",
        texture("opacity", "checkerboard", BOARD)
        + bsdf("conductor", texture("specular_reflectance", "checkerboard", BOARD)),
    ),
)
INSIDE = (
    '<shape type="{}"><transform name="to_world"><scale value="{}"/>'
    '<translate x="0.3" y="1.2" z="6"/></transform>{}</shape>'
)
"""Around the camera, which sees the surface from within: much of it reflects totally."""
GLOWING_CORE = (
    '<shape type="sphere"><transform name="to_world"><scale value="0.4"/>'
    '<translate y="0.7"/></transform><emitter type="area">'
    '<rgb name="radiance" value="3, 2, 1"/></emitter></shape>'
    '<shape type="sphere"><transform name="to_world"><scale value="0.7"/>'
    f'<translate y="0.7"/></transform>{bsdf("dielectric")}</shape>'
)
SCENES = {
    "metals": scene(row_of_materials(*METALS), LAMP + PANEL + WALLS),
    "glass": scene(row_of_materials(*GLASS), PANEL + WALLS),
    "masks": scene(row_of_materials(*MASKED), PANEL + WALLS),
    "textures": scene(row_of_materials(*TEXTURED), PANEL + WALLS),
    "textures under the sky": scene(
        row_of_materials(*TEXTURED[:3])
        + f'<shape type="shapegroup" id="group">{block(TEXTURED[0], 0, "disk")}'
        f"{block(TEXTURED[2])}</shape>"
        '<shape type="instance"><ref id="group"/><transform name="to_world">'
        '<translate x="1.8"/></transform></shape>',
        LAMP + SKY,
    ),
    "metals under the sky": scene(row_of_materials(*METALS), LAMP + SKY),
    "glass under the sky": scene(row_of_materials(*GLASS), SKY + WALLS),
    "light in glass": scene(GLOWING_CORE, PANEL),
    "within a ball of glass": scene(
        INSIDE.format("sphere", 0.5, bsdf("dielectric")), PANEL + WALLS, floor=""
    ),
    "within a cube of glass": scene(
        INSIDE.format("cube", 0.5, bsdf("dielectric", text("int_ior", "diamond"))),
        SKY + WALLS,
        floor="",
    ),
    "within a mirror": scene(
        INSIDE.format(
            "cube",
            5.0,
            bsdf("twosided", bsdf("diffuse") + bsdf("conductor", text("material", "Ag"))),
        ),
        WALLS.replace('z="3"', 'z="8"'),
        floor="",
    ),
    "stratified": scene(
        row_of_materials(*GLASS), PANEL + WALLS, eye=sensor(sampler="stratified")
    ),
    "an instance": scene(
        f'<shape type="shapegroup" id="group">{block(METALS[1], -0.5)}'
        f"{block(GLASS[0], 0.8, 'sphere')}</shape>"
        '<shape type="instance"><ref id="group"/><transform name="to_world">'
        '<rotate x="0.3" y="1" angle="40"/></transform></shape>',
        PANEL + WALLS,
    ),
}
