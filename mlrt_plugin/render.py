"""Renders a scene natively."""

from __future__ import annotations

import dataclasses
import os
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ._dispatch import core
from .emitters import check_areas, check_distances
from .errors import MlrtError, warn_of
from .integrators import own_aovs
from .object_set import RayQueries, add_timings, common_bounds, obtain_objects
from .options import (
    AOVS,
    BUILD_OPTIONS,
    SHADOW_OFFSETS,
    TRACE_OPTIONS,
    integer,
    split_options,
)
from .samplers import checked_spp, own_spp, possible_spp, rounded
from .scene_arrays import Lighting, SceneArrays, same_geometry
from .scene_import import SceneSource, import_scene, summarise
from .shading_choice import ShadingChoice, choice_for
from .shape_arrays import Shape
from .texture_arrays import fields_of
from .threads import thread_count
from .tree_cache import ObtainedTree, obtain_tree
from .tree_report import invisible_meshes, tree_report

if TYPE_CHECKING:
    from .hybrid.prepared import PreparedHybrid

Prepared: TypeAlias = "PreparedScene | PreparedHybrid"
Progress = Callable[[float], object]
"""Called with the share of the work that is done, from 0 to 1."""


@dataclasses.dataclass(frozen=True)
class RenderResult:
    """An image and how it came about.

    image: (H, W, 3) float32, linear RGB.
    aovs: by name: depth (H, W) float32, distance from the near plane in scene units, 0 for
    a miss; normal (H, W, 3) float32, shading normal in world space; both are filtered as
    colours are; prim (H, W) int32, the face that a pixel's first sample hit, -1 for a miss.
    Natively, faces of shapegroups and then analytic shapes are numbered on from those of
    the tree; where Mitsuba shades they are -1.
    timings: seconds of load, build and render; with a cache of trees those that
    `ObtainedTree` names in place of build.
    counters: what the traversal did, of `cpp/base/counters.h`, for primary and shadow rays;
    none where Mitsuba shades. Unlike pictures they may differ from run to run.
    warnings: what was approximated or ignored.
    """

    image: npt.NDArray[np.float32]
    aovs: dict[str, npt.NDArray[Any]]
    timings: dict[str, float]
    counters: dict[str, int]
    warnings: tuple[str, ...] = ()


NATIVE = ShadingChoice("native", "arrays of a scene are given")


@dataclasses.dataclass(frozen=True)
class PreparedScene(RayQueries):
    """A scene with its tree, ready to be rendered any number of times."""

    arrays: SceneArrays
    handle: Any
    tree: Any
    build_options: dict[str, Any]
    timings: dict[str, float]
    tree_warnings: tuple[str, ...] = ()
    shading: ShadingChoice = NATIVE
    objects: Any = None

    @property
    def lighting(self) -> Lighting:
        return self.arrays.lighting

    @property
    def spp(self) -> int:
        """Samples per pixel of the scene's sampler."""
        return self.arrays.spp

    @property
    def report(self) -> dict[str, Any]:
        """What the tree is like and what its builder did, see `tree_report`."""
        return tree_report(self.tree)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is approximated or ignored, a sentence each."""
        return self.arrays.warnings + self.tree_warnings

    def tree_for(self, arrays: SceneArrays, build_options: dict[str, Any]) -> Any:
        """The tree if it is that of other arrays too, bit for bit, else None."""
        same = build_options == self.build_options and same_geometry(self.arrays, arrays)
        return self.tree if same else None

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """All shapes, by the numbers that `closest_hit` gives."""
        return self.arrays.all_shapes()

    @property
    def shape_names(self) -> tuple[str, ...]:
        """What messages call them."""
        others = self.arrays.objects
        return self.arrays.shape_names + (others.shape_names if others is not None else ())

    def warn(self, stacklevel: int = 1) -> None:
        """Warns of what is approximated or ignored, as if the caller did."""
        warn_of(self.warnings, stacklevel + 1)

    def render(
        self,
        *,
        spp: int | None = None,
        seed: int = 0,
        aovs: Sequence[str] = (),
        shadow_offset: str | None = None,
        progress: Progress | None = None,
        **options: Any,
    ) -> RenderResult:
        """Renders the scene; `options` are fields of `TraceOptions`. See `render`.

        shadow_offset: None takes what the scene gives its integrator `mlrt`.
        """
        build, trace = split_options(options)
        if build:
            raise TypeError(f"option '{next(iter(build))}' is of prepare, not of render")
        check_aovs(aovs)
        name = next((str(f) for f in self.arrays.features if f.kind == "sampler"), "")
        asked = own_spp(self.arrays.spp, name) if spp is None else checked_spp(spp)
        sampler, film = self.arrays.sampler, self.arrays.film
        samples = possible_spp(sampler, asked, film.crop_width * film.crop_height)
        depth = self.lighting.integrator == "depth"
        wanted = list(
            dict.fromkeys([*aovs, *(["depth"] if depth else own_aovs(self.lighting))])
        )
        trace = {**self.lighting.own_options(TRACE_OPTIONS), **trace}
        shadow_offset = chosen_shadow_offset(self.lighting, shadow_offset)
        start = time.perf_counter()
        result = core.render(
            self.handle,
            samples,
            checked_seed(seed, self.arrays.base_seed),
            trace,
            wanted,
            progress,
            shadow_offset,
            {**dataclasses.asdict(sampler), "base_seed": self.arrays.base_seed},
            0 if depth else self.lighting.emitter_samples,
            0 if depth else self.lighting.bsdf_samples,
        )
        if progress is not None:
            progress(1.0)
        image, images = result["image"], dict(result["aovs"])
        if depth:
            image = as_depth(images["depth"])
            images = {name: images[name] for name in aovs}
        return RenderResult(
            image=image,
            aovs=images,
            timings={**self.timings, "render": time.perf_counter() - start},
            counters=dict(result["counters"]),
            warnings=self.warnings + rounded(sampler.type, asked, samples),
        )


def prepare(
    scene: SceneSource | SceneArrays,
    *,
    sensor: Any = 0,
    defines: Mapping[str, object] | None = None,
    resolution: tuple[int, int] | None = None,
    hide_emitters: bool | None = None,
    lighting: Lighting | None = None,
    shading: str | None = None,
    force_direct: bool = False,
    previous: Prepared | None = None,
    tree_cache: str | os.PathLike[str] | None = None,
    **options: Any,
) -> Prepared:
    """Reads a scene and builds its tree; `options` are of `BuildOptions`, and go before
    those that the scene gives its integrator `mlrt`. See `render`.

    lighting: what to render in place of what the scene's integrator asks for.
    previous: a scene whose tree is taken over if the geometry is the same.
    tree_cache: folder that the tree is taken from if it is there, and kept in if not.
    """
    build, trace = split_options(options)
    if trace:
        raise TypeError(f"option '{next(iter(trace))}' is of render, not of prepare")
    start = time.perf_counter()
    if isinstance(scene, SceneArrays):
        arrays, choice = scene, NATIVE
    else:
        summary = summarise(scene, sensor=sensor, defines=defines)
        choice = choice_for(summary, shading, lighting or summary.lighting)
        if choice.path == "mitsuba":
            # Not loaded where it is not used: Mitsuba's llvm variant takes a while.
            from .hybrid.prepared import prepare_hybrid

            return prepare_hybrid(
                scene,
                choice,
                sensor=sensor,
                defines=defines,
                resolution=resolution,
                hide_emitters=hide_emitters,
                lighting=lighting,
                force_direct=force_direct,
                previous=previous,
                tree_cache=tree_cache,
                build=build,
                summary=summary,
            )
        arrays = import_scene(
            scene,
            sensor=sensor,
            defines=defines,
            resolution=resolution,
            lighting=lighting,
            force_direct=force_direct,
            summary=summary,
        )
    build = {**arrays.lighting.own_options(BUILD_OPTIONS), **build}
    loaded = time.perf_counter()
    tree = previous.tree_for(arrays, build) if previous is not None else None
    if tree is None:
        obtained = obtain_tree(arrays.vertices, arrays.faces, build, tree_cache)
    else:
        obtained = ObtainedTree(tree, {"build": time.perf_counter() - loaded})
    others = obtain_objects(arrays.objects, len(arrays.faces), build, tree_cache)
    add_timings(obtained.timings, others.timings)
    bounds = common_bounds(obtained.tree, others.handle)
    check_distances(arrays.emitters, bounds)
    check_areas(arrays, bounds)
    hide = arrays.lighting.hide_emitters if hide_emitters is None else hide_emitters
    handle = core.Scene(
        obtained.tree,
        arrays.faces
        if len(arrays.normals) or arrays.textures or has_rows(arrays.uvs)
        else arrays.faces[:0],
        arrays.normals,
        [dataclasses.asdict(shape) for shape in arrays.all_shapes()],
        arrays.materials,
        [dataclasses.asdict(emitter) for emitter in arrays.emitters],
        dataclasses.asdict(arrays.camera),
        dataclasses.asdict(arrays.film),
        bool(hide),
        arrays.environment if arrays.environment.size else None,
        arrays.uvs,
        [fields_of(texture) for texture in arrays.textures],
        arrays.material_textures,
        others.handle,
        arrays.material_passes,
        [dataclasses.asdict(specular) for specular in arrays.speculars],
        arrays.material_speculars,
    )
    return PreparedScene(
        arrays,
        handle,
        obtained.tree,
        build,
        {"load": loaded - start, **obtained.timings},
        obtained.warnings + others.warnings + invisible_meshes(obtained.tree, arrays),
        choice,
        others.handle,
    )


def render(
    scene: SceneSource,
    *,
    spp: int | None = None,
    seed: int = 0,
    sensor: Any = 0,
    threads: int | None = None,
    aovs: Sequence[str] = (),
    shadow_offset: str | None = None,
    defines: Mapping[str, object] | None = None,
    **params: Any,
) -> RenderResult:
    """Renders a scene.

    scene: path of an XML file, dictionary as ``mi.load_dict`` takes it, or loaded
    ``mi.Scene``. spp: samples per pixel; None takes the number of the scene's sampler.
    seed: chooses the random numbers, as in ``mi.render``.
    sensor: number of the sensor, in the order of declaration; of a loaded scene also a
    sensor. threads: None takes all of Dr.Jit's pool.
    aovs: further images, of depth, normal, prim, cost (natively only) and moment
    ((H, W, 6) with mean and second moment in XYZ).
    shadow_offset: how shadow rays are kept off surfaces: "mitsuba", by Mitsuba's formula;
    "robust", by a bound of the error, for scenes of any size. None takes what the scene
    gives its integrator `mlrt`, else "mitsuba".
    defines: values of the file's $parameters.
    params: resolution, a pair (width, height); hide_emitters; shading, one of auto, native
    and mitsuba; force_direct, whether to render direct illumination where the scene's
    integrator asks for more; tree_cache, a folder that
    trees are kept in from one process to the next; progress, called with the share of the
    work that is done; and the options of `mlrt_plugin.options`, which change
    the time that is taken but not the image.

    What is approximated or ignored is warned of as MlrtWarning. Raises SceneError if the
    scene cannot be read, UnsupportedFeature if it uses what is not rendered,
    MlrtError or ValueError for other arguments that make no sense, TypeError for an
    unknown one, and KeyboardInterrupt within 0.2 s.
    """
    of_scene = {
        name: params.pop(name)
        for name in (
            "resolution",
            "hide_emitters",
            "shading",
            "force_direct",
            "tree_cache",
        )
        if name in params
    }
    progress = params.pop("progress", None)
    build, trace = split_options(params)
    check_aovs(aovs)
    if shadow_offset is not None:
        check_shadow_offset(shadow_offset)
    if spp is not None:
        checked_spp(spp)
    checked_seed(seed, 0)
    with thread_count(threads):
        prepared = prepare(scene, sensor=sensor, defines=defines, **of_scene, **build)
        prepared.warn(stacklevel=2)
        result = prepared.render(
            spp=spp,
            seed=seed,
            aovs=aovs,
            shadow_offset=shadow_offset,
            progress=progress,
            **trace,
        )
        warn_of((m for m in result.warnings if m not in prepared.warnings), 2)
        return result


def has_rows(array: npt.NDArray[Any] | None) -> bool:
    """Whether an array is there and not empty."""
    return array is not None and len(array) > 0


def as_depth(depth: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """The image (H, W, 3) of integrator `depth`, of depths (H, W)."""
    return np.repeat(depth[..., None], 3, axis=2)


def checked_seed(seed: int, base_seed: int) -> int:
    """The seed of the random numbers, to which Mitsuba adds that of the sampler."""
    seed = integer(seed, "seed")
    if not 0 <= seed <= 0xFFFFFFFF:
        raise MlrtError(f"seed = {seed} is out of range: it must be from 0 to 2**32 - 1")
    return (seed + base_seed) & 0xFFFFFFFF


def chosen_shadow_offset(lighting: Lighting, name: str | None) -> str:
    """The name, or for None what the scene gives its integrator `mlrt`, else Mitsuba's.
    Raises MlrtError for what is not in SHADOW_OFFSETS."""
    if name is None:
        own = lighting.own_options(("shadow_offset",))
        name = own.get("shadow_offset", SHADOW_OFFSETS[0])
    check_shadow_offset(name)
    return str(name)


def check_shadow_offset(name: object) -> None:
    """Raises MlrtError for what is not in SHADOW_OFFSETS."""
    if name not in SHADOW_OFFSETS:
        known = ", ".join(SHADOW_OFFSETS)
        raise MlrtError(f"shadow_offset '{name}' does not exist: choose from {known}")


def check_aovs(aovs: Sequence[str]) -> None:
    """Raises MlrtError for a name that is not in AOVS."""
    if isinstance(aovs, str):
        raise MlrtError(f"aovs must be a sequence of names, not the string '{aovs}'")
    for name in aovs:
        if name not in AOVS:
            raise MlrtError(f"aov '{name}' does not exist: choose from {', '.join(AOVS)}")
