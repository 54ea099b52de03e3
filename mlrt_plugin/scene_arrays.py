"""A scene as plain, immutable data: what is left of it once Mitsuba has read it.

The small classes mirror the structures of the same names in the native core's
``render/scene.h`` field by field; lengths are in scene units, angles in radians, points
and directions in world space.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from .object_arrays import ObjectArrays
from .shape_arrays import NONE, Shape, Specular
from .texture_arrays import Texture

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]


UNIT_AXES: tuple[Vec3, Vec3, Vec3] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def no_environment() -> npt.NDArray[np.float32]:
    """The picture of a scene without `envmap`."""
    return np.zeros((0, 0, 3), np.float32)


class HasGeometry(Protocol):
    """vertices: (V, 3) float32. faces: (F, 3) uint32."""

    @property
    def vertices(self) -> npt.NDArray[np.float32]: ...

    @property
    def faces(self) -> npt.NDArray[np.uint32]: ...


def same_geometry(one: HasGeometry, other: HasGeometry) -> bool:
    """Whether vertices and faces are the same, bit for bit."""
    return np.array_equal(one.faces, other.faces) and np.array_equal(
        one.vertices.view(np.uint32), other.vertices.view(np.uint32)
    )


@dataclass(frozen=True)
class Emitter:
    """A light source; ``type`` is one of point, spot, projector, directional, area,
    constant and envmap, of which a scene has at most one of the last two."""

    type: str
    radiance: Vec3
    position: Vec3 = (0.0, 0.0, 0.0)
    direction: Vec3 = (0.0, 0.0, 1.0)
    cutoff_angle: float = 0.0
    beam_width: float = 0.0
    shape: int = NONE
    radiance_texture: int = NONE
    rectangle: bool = False
    corner: Vec3 = (0.0, 0.0, 0.0)
    edge_u: Vec3 = (0.0, 0.0, 0.0)
    edge_v: Vec3 = (0.0, 0.0, 0.0)
    axes: tuple[Vec3, Vec3, Vec3] = UNIT_AXES
    half_size: Vec2 = (1.0, 1.0)
    mis_compensation: bool = False
    sampling_weight: float = 1.0


@dataclass(frozen=True)
class Camera:
    """A camera that looks along the third of its axes; the first points left.

    type: perspective, thinlens or orthographic. half_extent: of the last, half the width of
    the film, and what would be half its height if it were square, in scene units.
    samples_time: whether a random number of each sample is spent on its time.
    """

    origin: Vec3
    axes: tuple[Vec3, Vec3, Vec3]
    tan_half_fov_x: float
    near_clip: float = 0.01
    far_clip: float = 1e4
    principal_point_offset: Vec2 = (0.0, 0.0)
    type: str = "perspective"
    half_extent: Vec2 = (1.0, 1.0)
    aperture_radius: float = 0.0
    focus_distance: float = 1.0
    samples_time: bool = False


@dataclass(frozen=True)
class Sampler:
    """Where random numbers come from: ``type`` is that of a plugin. Without jitter samples
    lie in the middle of their cells."""

    type: str = "independent"
    jitter: bool = True


@dataclass(frozen=True)
class Film:
    """The film, the part of it that is rendered (both in pixels), and its filter."""

    width: int
    height: int
    crop_x: int
    crop_y: int
    crop_width: int
    crop_height: int
    filter: str = "gaussian"
    filter_radius: float = 2.0
    filter_stddev: float = 0.5
    filter_b: float = 1 / 3
    filter_c: float = 1 / 3
    sample_border: bool = False


@dataclass(frozen=True)
class Feature:
    """An element of the scene: a plugin of some kind, and whether it is rendered natively.

    ``reason`` is empty if it is, and otherwise says what is not supported. ``varies``: of a
    BSDF, whether its index of refraction is not the same everywhere.
    """

    kind: str
    plugin: str
    id: str = ""
    where: str = ""
    reason: str = ""
    varies: bool = False

    @property
    def native(self) -> bool:
        return not self.reason

    @property
    def file(self) -> str:
        """The file that declares the element; empty for a dictionary or loaded scene."""
        return self.where.rpartition(" line ")[0]

    def __str__(self) -> str:
        name = f"{self.kind} '{self.plugin}'"
        if self.id:
            name += f" with id '{self.id}'"
        return f"{name} at {self.where}" if self.where else name


@dataclass(frozen=True)
class Lighting:
    """What of the light transport the scene's integrator asks for."""

    integrator: str = "direct"
    emitter_samples: int = 1
    bsdf_samples: int = 1
    hide_emitters: bool = False
    parameters: dict[str, Any] = field(default_factory=dict)

    def own_options(self, names: Collection[str]) -> dict[str, Any]:
        """Those parameters of the integrator `mlrt` that are among `names`."""
        if self.integrator != "mlrt":
            return {}
        return {k: value for k, value in self.parameters.items() if k in names}


@dataclass(frozen=True)
class SceneArrays:
    """Everything that rendering needs.

    vertices: (V, 3) float32, world space.
    faces: (F, 3) uint32, numbers of vertices; the faces of a shape follow one another.
    normals: (V, 3) float32, unit; (0, 3) if no shape interpolates vertex normals.
    materials: (M, 2, 3) float32, linear RGB reflectance of the front and of the back.
    material_textures: (M, 3) uint32, numbers of textures in place of these two, and of the
    opacity, or NONE. material_passes: which materials let all light straight through; empty
    if none does. material_speculars: numbers of the `speculars` of the front and of the
    back, or NONE, and whether no side scatters; empty if there are none.
    uvs: (V, 2) float32; (0, 2) if nothing needs any.
    spp, base_seed: samples per pixel and seed of the sensor's sampler.
    features: what the scene uses; warnings: what is approximated or ignored, a sentence
    each. shape_names: what messages call the shapes. objects: what is not in these arrays:
    analytic shapes and instances. not_finite_faces: how many faces of
    each shape had a vertex that is not finite; they are points now.
    sampler: of the sensor.
    environment: (H, W, 3) float32, linear RGB radiance in latitude and longitude, the first
    row at the pole; (0, 0, 3) if no emitter is an `envmap`.
    """

    vertices: npt.NDArray[np.float32]
    faces: npt.NDArray[np.uint32]
    normals: npt.NDArray[np.float32]
    shapes: tuple[Shape, ...]
    materials: npt.NDArray[np.float32]
    emitters: tuple[Emitter, ...]
    camera: Camera
    film: Film
    lighting: Lighting
    spp: int
    base_seed: int
    features: tuple[Feature, ...]
    warnings: tuple[str, ...]
    shape_names: tuple[str, ...] = ()
    not_finite_faces: tuple[int, ...] = ()
    textures: tuple[Texture, ...] = ()
    material_textures: npt.NDArray[np.uint32] | None = None
    material_passes: tuple[bool, ...] = ()
    speculars: tuple[Specular, ...] = ()
    material_speculars: tuple[tuple[int, int, bool], ...] = ()
    uvs: npt.NDArray[np.float32] | None = None
    sampler: Sampler = Sampler()
    environment: npt.NDArray[np.float32] = field(default_factory=no_environment)
    objects: ObjectArrays | None = None

    def __post_init__(self) -> None:
        for array in (self.vertices, self.faces, self.normals, self.materials):
            array.setflags(write=False)
        for optional in (self.material_textures, self.uvs):
            if optional is not None:
                optional.setflags(write=False)
        self.environment.setflags(write=False)

    def all_shapes(self) -> tuple[Shape, ...]:
        """Those of the tree and of `objects`, in the order of their faces."""
        return self.shapes + (self.objects.shapes if self.objects is not None else ())
