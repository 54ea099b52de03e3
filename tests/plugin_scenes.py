"""Small scenes, each with a few of Mitsuba's plugins, which together hold all of them."""

from __future__ import annotations

from pathlib import Path

import scene_files

FILM = """<film type="hdrfilm"><integer name="width" value="{size[0]}"/>
<integer name="height" value="{size[1]}"/><rfilter type="{rfilter}"/></film>"""
VIEW = """<transform name="to_world">
<lookat origin="0.3, 1.2, 6" target="0, 0.5, 0" up="0, 1, 0"/></transform>"""
LAMP = """<emitter type="point"><point name="position" x="1.5" y="4" z="4"/>
<rgb name="intensity" value="18, 17, 15"/></emitter>"""
PANEL = """<shape type="rectangle"><transform name="to_world"><rotate x="1" angle="90"/>
<translate y="3"/></transform><emitter type="area"><rgb name="radiance" value="2, 2.5, 3"/>
</emitter></shape>"""
FLOOR = """<shape type="rectangle"><transform name="to_world"><scale value="4"/>
<rotate x="1" angle="-90"/></transform></shape>"""
DIRECT = '<integrator type="direct"/>'


def sensor(
    plugin: str = "perspective",
    parameters: str = "",
    sampler: str = "independent",
    spp: int = 4,
    rfilter: str = "box",
    view: str = VIEW,
    size: tuple[int, int] = (48, 36),
) -> str:
    count = f'<integer name="sample_count" value="{spp}"/>'
    return (
        f'<sensor type="{plugin}">{view}{parameters}'
        f'<sampler type="{sampler}">{count}</sampler>'
        f"{FILM.format(rfilter=rfilter, size=size)}</sensor>"
    )


def scene(
    body: str,
    lights: str = LAMP + PANEL,
    eye: str | None = None,
    integrator: str = DIRECT,
    floor: str = FLOOR,
) -> str:
    return (
        f'<scene version="3.0.0">{integrator}{eye or sensor()}{lights}{floor}{body}</scene>'
    )


def block(content: str = "", x: float = 0, plugin: str = "cube", size: float = 0.4) -> str:
    """A shape on the floor with a material in it."""
    return (
        f'<shape type="{plugin}"><transform name="to_world"><scale value="{size}"/>'
        f'<rotate y="1" angle="25"/><translate x="{x}" y="0.5"/></transform>'
        f"{content}</shape>"
    )


def row_of_materials(*materials: str) -> str:
    """A sphere and a cube of each material, side by side."""
    places = [-2.2, -1.1, 0.0, 1.1, 2.2]
    return "".join(
        block(material, x) + block(material, x + 0.5, "sphere", 0.3)
        for material, x in zip(materials, places, strict=False)
    )


def bsdf(plugin: str, content: str = "") -> str:
    return f'<bsdf type="{plugin}">{content}</bsdf>'


def colour(name: str, value: str = "0.6, 0.3, 0.2") -> str:
    return f'<rgb name="{name}" value="{value}"/>'


def number(name: str, value: float) -> str:
    return f'<float name="{name}" value="{value}"/>'


def text(name: str, value: str | Path) -> str:
    return f'<string name="{name}" value="{value}"/>'


def texture(name: str, plugin: str, content: str = "") -> str:
    return f'<texture type="{plugin}" name="{name}">{content}</texture>'


SKY = (
    '<emitter type="envmap"><string name="filename" value="sky.exr"/>'
    '<float name="scale" value="0.7"/><transform name="to_world">'
    '<rotate x="1" angle="20"/><rotate y="1" angle="75"/></transform></emitter>'
)
COMPENSATED = SKY.replace(
    "</emitter>", '<boolean name="mis_compensation" value="true"/></emitter>'
)
CONSTANT = f'<emitter type="constant">{colour("radiance")}</emitter>'

BUMPS = texture("arbitrary", "bitmap", text("filename", "image.png"))

SCENES = {
    "native": scene(block(bsdf("twosided", bsdf("diffuse", colour("reflectance"))))),
    "plastics": scene(
        row_of_materials(
            bsdf("plastic"),
            bsdf("roughplastic"),
            bsdf("pplastic"),
            bsdf("principled", number("metallic", 0.5) + number("roughness", 0.3)),
            bsdf("principledthin", number("roughness", 0.3)),
        )
    ),
    "metals and glass": scene(
        row_of_materials(
            bsdf("conductor", text("material", "Au")),
            bsdf("roughconductor", text("material", "Cu")),
            bsdf("dielectric"),
            bsdf("roughdielectric"),
            bsdf("thindielectric"),
        )
    ),
    "compound materials": scene(
        row_of_materials(
            bsdf("mask", bsdf("diffuse") + number("opacity", 0.4)),
            bsdf("blendbsdf", bsdf("plastic") + bsdf("diffuse") + number("weight", 0.3)),
            bsdf("bumpmap", BUMPS + bsdf("roughplastic")),
            bsdf(
                "normalmap",
                texture("normalmap", "bitmap", text("filename", "normals.exr"))
                + bsdf("roughplastic"),
            ),
            bsdf("null"),
        )
    ),
    "twosided": scene(
        row_of_materials(
            bsdf("twosided", bsdf("roughplastic")),
            bsdf("twosided", bsdf("diffuse") + bsdf("roughconductor")),
        )
    ),
    "polarising materials": scene(
        row_of_materials(bsdf("polarizer"), bsdf("circular"), bsdf("retarder"))
    ),
    "textures": scene(
        row_of_materials(
            bsdf(
                "diffuse",
                texture("reflectance", "bitmap", text("filename", "image.png")),
            ),
            bsdf("diffuse", texture("reflectance", "checkerboard")),
            bsdf(
                "diffuse",
                texture(
                    "reflectance",
                    "volume",
                    '<volume type="constvolume" name="volume">'
                    f"{colour('value', '0.2, 0.5, 0.7')}</volume>",
                ),
            ),
            bsdf(
                "diffuse",
                texture(
                    "reflectance",
                    "volume",
                    '<volume type="gridvolume" name="volume">'
                    f"{text('filename', 'grid.vol')}</volume>",
                ),
            ),
        )
        + '<shape type="ply"><string name="filename" value="coloured.ply"/>'
        + bsdf(
            "diffuse",
            texture("reflectance", "mesh_attribute", text("name", "vertex_color")),
        )
        + "</shape>",
    ),
    "round shapes": scene(
        block("", -2, "sphere")
        + block("", -1, "disk")
        + block("", 0, "cylinder")
        + '<shape type="bsplinecurve"><string name="filename" value="curve.txt"/></shape>'
        + '<shape type="linearcurve"><string name="filename" value="curve.txt"/>'
        '<transform name="to_world"><translate x="0.8"/></transform></shape>'
    ),
    "distance field": scene(
        '<shape type="sdfgrid"><string name="filename" value="grid.vol"/>'
        '<transform name="to_world"><translate x="-0.5"/></transform></shape>'
    ),
    "ellipsoids": scene(
        '<shape type="ellipsoids"><string name="filename" value="ellipsoids.ply"/></shape>'
        '<shape type="ellipsoidsmesh"><string name="filename" value="ellipsoids.ply"/>'
        '<transform name="to_world"><translate x="1.2"/></transform></shape>'
    ),
    "instances": scene(
        '<shape type="shapegroup" id="group"><shape type="cube"><transform name="to_world">'
        '<scale value="0.3"/></transform></shape><shape type="sphere"><float name="radius" '
        'value="0.35"/></shape></shape>'
        + "".join(
            f'<shape type="instance"><ref id="group"/><transform name="to_world">'
            f'<rotate y="1" angle="{40 * i}"/><translate x="{i - 1}" y="0.5"/></transform>'
            "</shape>"
            for i in range(3)
        )
    ),
    "instances of meshes": scene(
        '<shape type="shapegroup" id="group"><shape type="cube"><transform name="to_world">'
        '<scale value="0.3"/></transform>'
        + bsdf("diffuse", texture("reflectance", "checkerboard"))
        + '</shape><shape type="ply"><string name="filename" value="smooth.ply"/>'
        + bsdf("twosided", bsdf("roughplastic"))
        + "</shape></shape>"
        + "".join(
            f'<shape type="instance"><ref id="group"/><transform name="to_world">'
            f'<scale x="{(-1) ** i}" y="{0.6 + 0.2 * i}" z="1"/>'
            f'<rotate y="1" angle="{50 * i}"/>'
            f'<translate x="{1.2 * i - 1.2}" y="0.5"/></transform></shape>'
            for i in range(3)
        )
    ),
    "meshes": scene(
        scene_files.mesh_shape("triangle.obj")
        + scene_files.mesh_shape("square.ply").replace('id="mesh"', "")
        + scene_files.mesh_shape("square.serialized").replace('id="mesh"', "")
        + '<shape type="merge"><shape type="cube"><transform name="to_world"><scale '
        'value="0.2"/><translate x="-1" y="0.4"/></transform></shape><shape type="cube">'
        '<transform name="to_world"><scale value="0.2"/><translate x="1.6" y="0.3"/>'
        "</transform></shape></shape>"
    ),
    "envmap": scene(
        block(bsdf("roughconductor"), 0, "sphere"),
        lights='<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>',
    ),
    "constant": scene(
        block(bsdf("roughplastic")),
        lights='<emitter type="constant"><rgb name="radiance" value="0.4, 0.5, 0.7"/>'
        "</emitter>",
    ),
    "sunsky": scene(
        block(bsdf("roughplastic")),
        lights='<emitter type="sunsky"><float name="turbidity" value="4"/></emitter>',
    ),
    "lamps": scene(
        block(bsdf("roughplastic")),
        lights="""<emitter type="spot"><transform name="to_world"><lookat origin="2, 4, 3"
target="0, 0, 0" up="0, 1, 0"/></transform><rgb name="intensity" value="30"/></emitter>
<emitter type="directional"><vector name="direction" x="0.2" y="-1" z="-0.3"/>
<rgb name="irradiance" value="0.4"/></emitter>
<emitter type="projector"><transform name="to_world"><lookat origin="-2, 3, 3"
target="0, 0, 0" up="0, 1, 0"/></transform><texture type="bitmap" name="irradiance">
<string name="filename" value="image.png"/></texture><float name="scale" value="12"/>
</emitter>
<shape type="disk"><transform name="to_world"><scale value="0.5"/><rotate x="1"
angle="90"/><translate x="-1" y="2"/></transform><emitter type="directionalarea">
<rgb name="radiance" value="0.5"/></emitter></shape>
<shape type="sphere"><float name="radius" value="0.3"/><point name="center" x="1.8" y="1.6"
z="0"/><emitter type="area"><rgb name="radiance" value="6, 4, 2"/></emitter></shape>""",
    ),
    "textured light": scene(
        block(bsdf("roughplastic")),
        lights="""<shape type="rectangle"><transform name="to_world"><rotate x="1"
angle="90"/><translate y="2.5"/></transform><emitter type="area">
<texture type="bitmap" name="radiance">
<string name="filename" value="image.png"/></texture></emitter></shape>""",
    ),
    "spectra": scene(
        row_of_materials(
            bsdf("diffuse", texture("reflectance", "uniform", number("value", 0.4))),
            bsdf("diffuse", texture("reflectance", "srgb", colour("color"))),
            bsdf("diffuse", '<spectrum name="reflectance" value="400:0.1, 700:0.8"/>'),
            bsdf(
                "diffuse",
                '<spectrum name="reflectance" value="400:0.1, 500:0.4, 700:0.8"/>',
            ),
        ),
        lights='<emitter type="point"><point name="position" x="1" y="4" z="4"/>'
        '<spectrum name="intensity" value="20"/></emitter>',
    ),
    "light spectra": scene(
        block(bsdf("diffuse", texture("reflectance", "rawconstant", number("value", 0.4))))
        + '<shape type="linearcurve"><string name="filename" value="curve.txt"/>'
        f"{bsdf('hair', number('eumelanin', 0.2))}</shape>",
        lights="""<emitter type="point"><point name="position" x="1" y="4" z="4"/>
<spectrum name="intensity" type="d65"><float name="scale" value="20"/></spectrum>
</emitter>""",
    ),
    "thinlens": scene(
        block(bsdf("plastic")),
        eye=sensor(
            "thinlens",
            number("aperture_radius", 0.1) + number("focus_distance", 6),
            rfilter="gaussian",
        ),
    ),
    "orthographic": scene(
        block(bsdf("plastic")),
        eye=sensor(
            "orthographic",
            view=VIEW.replace("<lookat", '<scale x="2" y="2"/><lookat'),
            rfilter="tent",
        ),
    ),
    "distant": scene(
        block(bsdf("plastic")),
        eye=sensor(
            "distant",
            '<vector name="direction" x="0.1" y="-1" z="-0.2"/>',
            view="",
            size=(1, 1),
            spp=64,
        ),
    ),
    "radiancemeter": scene(
        block(bsdf("plastic")), eye=sensor("radiancemeter", size=(1, 1), spp=16)
    ),
    "irradiancemeter": scene(
        block(bsdf("plastic"))
        + '<shape type="rectangle"><transform name="to_world"><translate z="1" y="1"/>'
        f"</transform>{sensor('irradiancemeter', view='')}</shape>",
        eye=sensor(),
    ),
    **{
        f"rfilter {name}": scene(block(bsdf("plastic")), eye=sensor(rfilter=name))
        for name in ("mitchell", "catmullrom", "lanczos")
    },
    **{
        f"sampler {name}": scene(
            block(bsdf("roughplastic")), eye=sensor(sampler=name, spp=16)
        )
        for name in ("stratified", "multijitter", "orthogonal", "ldsampler")
    },
    "medium": scene(
        block(
            bsdf("roughplastic") + '<medium type="homogeneous" name="interior">'
            '<rgb name="albedo" value="0.5"/></medium>'
        )
        + block(
            '<medium type="heterogeneous" name="interior"><volume type="constvolume" '
            'name="sigma_t"><float name="value" value="0.5"/></volume></medium>',
            1.2,
        )
    ),
}
