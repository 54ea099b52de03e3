"""What becomes of each plugin of Mitsuba, as a table: ``python -m mlrt_plugin.coverage``.

The table is made from what the program itself decides by, so it cannot tell otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

from .elements import Element
from .features import LIGHT_TEXTURES, REFUSED, reason_against
from .integrators import AOV_NAMES, TAKEN_OVER, what_is_missing
from .materials import SPECULAR
from .scene_arrays import Lighting

MITSUBA = "3.9.1"
PLUGINS = {
    "shape": (
        *("obj", "ply", "serialized", "cube", "rectangle", "merge", "blender"),
        *("sphere", "disk", "cylinder", "bsplinecurve", "linearcurve", "sdfgrid"),
        *("ellipsoids", "ellipsoidsmesh", "shapegroup", "instance"),
    ),
    "bsdf": (
        *("diffuse", "twosided", "mask", "null", "blendbsdf", "bumpmap", "normalmap"),
        *("plastic", "roughplastic", "conductor", "roughconductor", "dielectric"),
        *("roughdielectric", "thindielectric", "principled", "principledthin", "hair"),
        *("measured", "measured_polarized", "pplastic", "polarizer", "retarder"),
        "circular",
    ),
    "emitter": (
        *("point", "spot", "directional", "area", "constant", "envmap", "projector"),
        *("directionalarea", "sunsky", "timed_sunsky"),
    ),
    "texture": (
        *("bitmap", "checkerboard", "mesh_attribute", "volume", "uniform", "srgb", "d65"),
        *("regular", "irregular", "blackbody", "rawconstant"),
    ),
    "volume": ("constvolume", "gridvolume"),
    "medium": ("homogeneous", "heterogeneous"),
    "phase function": ("hg", "isotropic", "rayleigh", "sggx", "tabphase", "blendphase"),
    "sensor": (
        *("perspective", "thinlens", "orthographic", "radiancemeter", "irradiancemeter"),
        *("distant", "batch"),
    ),
    "film": ("hdrfilm", "specfilm"),
    "rfilter": ("box", "gaussian", "tent", "mitchell", "catmullrom", "lanczos"),
    "sampler": ("independent", "stratified", "multijitter", "orthogonal", "ldsampler"),
    "integrator": (
        *("direct", "path", "depth", "aov", "moment", "ptracer", "stokes", "volpath"),
        *("volpathmis", "prb", "prb_basic", "prb_projective", "prbvolpath"),
        *("direct_projective", "volprim_rf_basic"),
    ),
}
"""All plugins of Mitsuba, by the kind of object that they make."""
NO_LIGHT_SAMPLE = "black for light samples; BSDF samples find lights in it"
OTHER_NOISE = "; with samplers but `independent` and light samples too, of other noise"
HIT_BY_MITSUBA = "where Mitsuba shades, it also finds the hits"
ON_MATERIALS = (
    "on materials of all native shapes, as `radiance` where that is native, and as "
    "`irradiance` of `projector`"
)
ON_MESHES = (
    "on materials of meshes that are not instanced; else by Mitsuba, where as `radiance` "
    "it has the fault of textures on meshes, see `area`"
)
REMARKS = {
    ("bsdf", "twosided"): "of `diffuse` and `conductor`; with others by Mitsuba",
    ("bsdf", "diffuse"): "in constant colours and with native textures",
    ("bsdf", "mask"): "of native materials but another mask; shadow rays "
    "stop at it, and BSDF samples find lights behind it, as in `direct`",
    ("bsdf", "null"): "BSDF samples find lights behind it",
    **{("bsdf", plugin): NO_LIGHT_SAMPLE + OTHER_NOISE for plugin in SPECULAR},
    ("bsdf", "conductor"): NO_LIGHT_SAMPLE + ", by Mitsuba if `eta` or `k` has a texture",
    **{("texture", plugin): ON_MATERIALS for plugin in LIGHT_TEXTURES},
    ("texture", "mesh_attribute"): ON_MESHES,
    ("emitter", "area"): f"in constant colours, and with {' and '.join(LIGHT_TEXTURES)} "
    "textures on `rectangle`, `sphere`, `disk` and `cylinder`. Left to Mitsuba are "
    "textures where its own samples do not agree, so that there is no right image to "
    "match: meshes, "
    "of which emitter samples light one of the faces that share a point of the texture, "
    "whichever Embree finds (of a cube one of six), and BSDF samples all; flipped "
    "rectangles, of which emitter samples take the other side to glow than BSDF samples; "
    "and spheres and cylinders that are turned, of which emitter samples take light from "
    "other points than their density is of",
    ("emitter", "envmap"): "with `mis_compensation` and no BSDF samples without the light "
    "that is left to these, as in Mitsuba; a warning says so",
    ("emitter", "spot"): "in constant colours, and without scale; else, which is rare, by "
    "Mitsuba",
    ("emitter", "directional"): "without scale; else, which is rare, by Mitsuba",
    ("sensor", "orthographic"): "without shear; else, which is rare, by Mitsuba",
    ("sampler", "orthogonal"): "of `strength` 2; else, which is rare, by Mitsuba",
    ("integrator", "direct"): "with up to 256 samples of emitters and of BSDFs natively; "
    "with more by Mitsuba",
    ("integrator", "path"): "with `max_depth` 1, or 2, which is taken as `direct`; else "
    "`--force-direct`",
    ("integrator", "aov"): f"of {', '.join(f'`{name}`' for name in AOV_NAMES)}; else "
    "`--force-direct`",
    ("integrator", "moment"): "around one `direct` or `path` with `max_depth` "
    "2; else `--force-direct`",
    ("shape", "shapegroup"): "a tree of its own; where Mitsuba shades, see `instance`",
    ("shape", "instance"): "where Mitsuba shades, of meshes it is written out into the "
    "tree, and Mitsuba hits others",
    ("shape", "sphere"): HIT_BY_MITSUBA,
    ("shape", "disk"): HIT_BY_MITSUBA,
    ("shape", "cylinder"): HIT_BY_MITSUBA,
    ("shape", "merge"): "shading; its meshes are in the tree",
    ("shape", "blender"): "shading; its mesh is in the tree; not tested, as it takes "
    "addresses in Blender's memory",
    ("medium", "homogeneous"): "no effect, as in `direct`; a warning says so",
    ("medium", "heterogeneous"): "no effect, as in `direct`; a warning says so",
    ("bsdf", "measured"): "not tested, as its measurements are not free",
    ("bsdf", "measured_polarized"): "not tested, as its measurements are not free",
}
"""What a verdict leaves open."""


@dataclass(frozen=True)
class Row:
    """One plugin: `verdict` is native, by Mitsuba, refused, or taken over."""

    kind: str
    plugin: str
    verdict: str
    remark: str = ""


def coverage_rows() -> list[Row]:
    """All plugins of Mitsuba, and who renders them."""
    return [row_of(kind, plugin) for kind, names in PLUGINS.items() for plugin in names]


def row_of(kind: str, plugin: str) -> Row:
    """What becomes of one plugin."""
    remark = REMARKS.get((kind, plugin), "")
    if (kind, plugin) in REFUSED:
        return Row(kind, plugin, "refused", REFUSED[kind, plugin])
    if kind == "integrator":
        if plugin in TAKEN_OVER:
            return Row(kind, plugin, "taken over", remark)
        missing = what_is_missing(Lighting(plugin))
        return Row(kind, plugin, "with --force-direct", f"without {missing}")
    if not reason_against(Element(kind, plugin)):
        return Row(kind, plugin, "native", remark)
    if kind == "shape" and not remark:
        remark = "hits and shading"
    if kind == "phase function":
        remark = REMARKS["medium", "homogeneous"]
    return Row(kind, plugin, "by Mitsuba", remark)


def coverage_table() -> str:
    """The table in Markdown."""
    lines = [
        "# What is rendered",
        "",
        f"One row a plugin of Mitsuba {MITSUBA}; `python -m mlrt_plugin.coverage` prints "
        "this page.",
        "",
        "| kind | plugin | rendered | |",
        "|---|---|---|---|",
    ]
    lines += [
        f"| {row.kind} | `{row.plugin}` | {row.verdict} | {row.remark} |"
        for row in coverage_rows()
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(coverage_table(), end="")
