"""Looking into loaded Mitsuba objects of any variant, whichever variant is set at the
moment."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Any

import mitsuba as mi
import numpy as np
import numpy.typing as npt

from .errors import SceneError, UnsupportedFeature
from .scene_arrays import Vec3

PLUGIN_OF_CLASS = {
    "OBJMesh": "obj",
    "PLYMesh": "ply",
    "SerializedMesh": "serialized",
    "Rectangle": "rectangle",
    "Cube": "cube",
    "Mesh": "mesh",
    "Sphere": "sphere",
    "Disk": "disk",
    "Cylinder": "cylinder",
    "Instance": "instance",
    "ShapeGroupPlugin": "shapegroup",
    "SmoothDiffuse": "diffuse",
    "TwoSidedBRDF": "twosided",
    "MaskBSDF": "mask",
    "SmoothConductor": "conductor",
    "SmoothDielectric": "dielectric",
    "ThinDielectric": "thindielectric",
    "Null": "null",
    "PointLight": "point",
    "SpotLight": "spot",
    "Projector": "projector",
    "DirectionalEmitter": "directional",
    "AreaLight": "area",
    "ConstantBackgroundEmitter": "constant",
    "EnvironmentMapEmitter": "envmap",
    "PerspectiveCamera": "perspective",
    "ThinLensCamera": "thinlens",
    "OrthographicCamera": "orthographic",
    "HDRFilm": "hdrfilm",
    "BoxFilter": "box",
    "GaussianFilter": "gaussian",
    "TentFilter": "tent",
    "MitchellNetravaliFilter": "mitchell",
    "CatmullRomFilter": "catmullrom",
    "LanczosSincFilter": "lanczos",
    "IndependentSampler": "independent",
    "StratifiedSampler": "stratified",
    "MultijitterSampler": "multijitter",
    "OrthogonalSampler": "orthogonal",
    "LowDiscrepancySampler": "ldsampler",
    "DirectIntegrator": "direct",
    "PathIntegrator": "path",
    "DepthIntegrator": "depth",
    "AOVIntegrator": "aov",
    "MlrtIntegrator": "mlrt",
    "UniformSpectrum": "uniform",
    "SRGBReflectanceSpectrum": "srgb",
    "Checkerboard": "checkerboard",
    "MeshAttribute": "mesh_attribute",
    **{
        f"BitmapTextureImpl[{storage}]": "bitmap"
        for storage in ("uint8", "float16", "float32", "float64")
    },
}
"""Plugin names of the classes of Mitsuba that scenes commonly use; others go by their
class."""


ORTHOGONAL = 1e-3
"""How large the products of axes may be that count as orthogonal."""


def plugin_name(instance: Any) -> str:
    """Name under which the plugin of a loaded object is written in a scene file."""
    name = str(instance.class_name())
    return PLUGIN_OF_CLASS.get(name, name)


def variant_module(instance: Any) -> Any:
    """The Mitsuba module of the variant that an object was loaded in."""
    return getattr(mi, instance.variant_name())


_listeners: dict[str, Any] = {}


def _listener(module: Any, variant: str) -> Any:
    """A traversal callback class of the variant: it must derive from that variant's own."""
    if variant not in _listeners:

        class Listener(module.TraversalCallback):  # type: ignore[misc]
            def __init__(self) -> None:
                super().__init__()
                self.found: dict[str, tuple[Any, Any]] = {}

            def put(self, name: str, value: Any, flags: Any, cpptype: Any = None) -> None:
                self.found[name] = (value, cpptype)

        _listeners[variant] = Listener
    return _listeners[variant]


def members(instance: Any) -> dict[str, Any]:
    """Parameters and nested objects that an object shows to ``mi.traverse``, by name."""
    module = variant_module(instance)
    listener = _listener(module, instance.variant_name())()
    instance.traverse(listener)
    return {
        name: value
        if isinstance(value, mi.Object)
        else module.get_property(value, cpptype, instance)
        for name, (value, cpptype) in listener.found.items()
    }


def set_members(instance: Any, values: dict[str, npt.NDArray[Any]]) -> None:
    """Fills arrays that an object shows to ``mi.traverse``, and tells it."""
    module = variant_module(instance)
    listener = _listener(module, instance.variant_name())()
    instance.traverse(listener)
    for name, value in values.items():
        place, cpptype = listener.found[name]
        kind = type(module.get_property(place, cpptype, instance))
        module.set_property(place, cpptype, kind(value))
    instance.parameters_changed(list(values))


def described(instance: Any, name: str, default: str = "") -> str:
    """A parameter that only the printed description of an object tells."""
    match = re.search(rf"\b{name} = ([^\s,\]]+)", str(instance))
    return match.group(1) if match else default


def number(value: Any) -> float:
    """A scalar, or the only entry of a Dr.Jit array."""
    return float(np.asarray(value, dtype=np.float64).reshape(-1)[0])


def vec3(value: Any) -> Vec3:
    """Three numbers from anything that holds three."""
    x, y, z = (float(c) for c in np.asarray(value, dtype=np.float64).reshape(3))
    return x, y, z


def matrix(transform: Any) -> npt.NDArray[np.float64]:
    """The (4, 4) float64 matrix of a transformation."""
    return np.asarray(np.array(transform.matrix), dtype=np.float64).reshape(4, 4)


def scalar_matrices(matrices: Iterable[Any], count: int) -> npt.NDArray[np.float64]:
    """(count, 4, 4) float64 of matrices of a parsed scene's transformations.

    By DLPack, as there may be a hundred thousand, and NumPy takes an array protocol of
    Dr.Jit's otherwise that is several times slower.
    """
    result = np.empty((count, 4, 4))
    for place, matrix in zip(result, matrices, strict=True):
        place[:] = np.from_dlpack(matrix)
    return result


def is_singular(to_world: npt.NDArray[np.float64]) -> bool:
    """Whether a finite matrix flattens what it moves."""
    return bool(are_singular(to_world[None])[0])


def are_singular(to_world: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Which of (N, 4, 4) finite matrices flatten what they move."""
    stretch = np.linalg.svd(to_world[:, :3, :3], compute_uv=False)
    return np.asarray(stretch[:, 2] <= 1e-12 * stretch[:, 0])


def is_orthogonal(to_world: npt.NDArray[np.float64]) -> bool:
    """Whether the axes of an invertible matrix are orthogonal, of any length."""
    axes = to_world[:3, :3] / np.linalg.norm(to_world[:3, :3], axis=0)
    return bool(np.allclose(axes.T @ axes, np.eye(3), atol=ORTHOGONAL))


def check_invertible(to_world: npt.NDArray[np.float64], name: str) -> None:
    """Raises SceneError for a matrix that is not finite or flattens what it moves."""
    check_all_invertible(to_world[None], [name])


def check_all_invertible(
    to_world: npt.NDArray[np.float64], names: Sequence[object]
) -> None:
    """Raises SceneError for the first of (N, 4, 4) matrices that is not finite or flattens
    what it moves; `names` say whose they are."""
    finite: npt.NDArray[np.bool_] = np.asarray(np.isfinite(to_world).all(axis=(1, 2)))
    singular = are_singular(np.where(finite[:, None, None], to_world, np.eye(4)))
    for number in np.flatnonzero(~finite | singular)[:1]:
        check_finite(to_world[number], str(names[number]))
        raise SceneError(
            f"{names[number]} has a singular to_world, which flattens it: no scale may be 0"
        )


def check_finite(to_world: npt.NDArray[np.float64], name: str) -> None:
    """Raises SceneError for a matrix that holds NaN or infinity."""
    if not np.isfinite(to_world).all():
        raise SceneError(f"{name} has a to_world with NaN or infinite entries: repair it")


def color(spectrum: Any, owner: str) -> Vec3:
    """Linear RGB of a spectrum that is the same everywhere.

    Raises SceneError if it is not finite, UnsupportedFeature if it varies in space or is
    not one that an RGB variant stores as a colour; ``owner`` says what it belongs to.
    """
    plugin = plugin_name(spectrum)
    if plugin in ("uniform", "srgb"):
        value = np.asarray(members(spectrum)["value"], np.float64).reshape(-1)
        if not np.isfinite(value).all():
            raise SceneError(f"{owner} has a colour with NaN or infinite parts: repair it")
        return vec3(np.broadcast_to(value, 3))
    raise UnsupportedFeature(
        f"{owner} has a '{plugin}' texture, and only constant colours are supported so "
        "far: "
        "replace it by an <rgb> value"
    )
