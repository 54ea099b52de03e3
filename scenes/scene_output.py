"""What generated scenes are written with: PLY meshes, the XML that puts them together, and
the command line of the generators."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

Rgb = tuple[float, float, float]
Vector = tuple[float, float, float]

PLY_FACE = np.dtype([("corners", "u1"), ("indices", "<i4", 3)])


class View(NamedTuple):
    """A perspective camera, z up."""

    fov: float
    """Degrees, horizontally."""
    origin: Vector
    target: Vector


def ply(vertices: ArrayLike, faces: ArrayLike, decimals: int = 5) -> bytes:
    """A binary little-endian PLY file of triangles.

    ``vertices``: (n, 3) coordinates, rounded to ``decimals`` places, because sin and cos
    may differ in the last bit between machines; ``faces``: (m, 3) indices.
    """
    points = np.round(np.asarray(vertices, dtype=np.float64), decimals).astype("<f4")
    indices = np.asarray(faces)
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(indices)}\n"
        "property list uchar int vertex_indices\nend_header\n"
    )
    packed = np.empty(len(indices), PLY_FACE)
    packed["corners"] = 3
    packed["indices"] = indices
    return header.encode() + points.tobytes() + packed.tobytes()


XML_HEAD = """<?xml version="1.0" encoding="utf-8"?>
<!-- Written by generate.py. Metres, z up. -->
<scene version="3.0.0">
    <default name="spp" value="16"/>
    <default name="res" value="512"/>
    <default name="resx" value="$res"/>
    <default name="resy" value="$res"/>
    <default name="rfilter" value="box"/>

    <integrator type="direct">
        <integer name="emitter_samples" value="1"/>
        <integer name="bsdf_samples" value="0"/>
    </integrator>

    <sensor type="perspective">
        <float name="fov" value="{fov}"/>
        <transform name="to_world">
            <lookat origin="{origin}" target="{target}" up="0, 0, 1"/>
        </transform>
        <sampler type="independent">
            <integer name="sample_count" value="$spp"/>
        </sampler>
        <film type="hdrfilm">
            <integer name="width" value="$resx"/>
            <integer name="height" value="$resy"/>
            <rfilter type="$rfilter"/>
        </film>
    </sensor>

{emitters}"""

XML_POINT_LIGHT = """    <emitter type="point" id="{name}">
        <point name="position" value="{position}"/>
        <rgb name="intensity" value="{intensity}"/>
    </emitter>
"""

XML_MESH = """
    <bsdf type="twosided" id="{name}">
        <bsdf type="diffuse">
            <rgb name="reflectance" value="{colour}"/>
        </bsdf>
    </bsdf>
    <shape type="ply" id="{name}-mesh">
        <string name="filename" value="meshes/{name}.ply"/>
        <boolean name="face_normals" value="true"/>
        <ref id="{name}"/>
    </shape>
"""


def listed(numbers: Iterable[float]) -> str:
    return ", ".join(str(round(number, 5)) for number in numbers)


def point_light(name: str, position: Vector, intensity: Rgb) -> str:
    return XML_POINT_LIGHT.format(
        name=name, position=listed(position), intensity=listed(intensity)
    )


def scene_xml(view: View, emitters: str, colours: Mapping[str, Rgb]) -> bytes:
    """The scene of the meshes ``meshes/NAME.ply``, each diffuse in its colour."""
    head = XML_HEAD.format(
        fov=view.fov,
        origin=listed(view.origin),
        target=listed(view.target),
        emitters=emitters,
    )
    meshes = (XML_MESH.format(name=n, colour=listed(c)) for n, c in colours.items())
    return (head + "".join(meshes) + "</scene>\n").encode()


def write_files(folder: Path, files: Iterable[tuple[str, bytes]]) -> None:
    """Writes files, each under a temporary name first, so that none is ever seen half
    written.

    The scene's XML comes last in ``files``: where it is, its meshes are.
    """
    for name, data in files:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
        try:
            partial.write_bytes(data)
            partial.replace(path)
        finally:
            partial.unlink(missing_ok=True)


def whole_number(name: str, low: int, high: int) -> Callable[[str], int]:
    """A reader of whole numbers from ``low`` to ``high`` for argparse."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            number = None
        if number is None or not low <= number <= high:
            raise argparse.ArgumentTypeError(
                f"{name} is a whole number from {low} to {high}, not {text!r}"
            )
        return number

    return read


class Request(NamedTuple):
    """What the user asked a generator for."""

    triangles: int
    seed: int
    folder: Path


def run(
    description: str,
    folder: Path,
    sizes: tuple[int, int, int],
    write: Callable[[Request], str],
    arguments: list[str] | None = None,
) -> None:
    """The command line of a generator.

    ``folder`` is where the files go unless the user says otherwise, ``sizes`` the
    smallest, the usual and the largest number of triangles; ``write`` returns a sentence to
    print. Ends the process with a sentence if the request cannot be met.
    """
    low, usual, high = sizes
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument(
        "--triangles",
        type=whole_number("the number of triangles", low, high),
        default=usual,
        help=f"about how many, {low} to {high} (default: {usual})",
    )
    parser.add_argument(
        "--seed",
        type=whole_number("the seed", 0, 2**32 - 1),
        default=1,
        help="of what is left to chance (default: 1)",
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=folder,
        metavar="FOLDER",
        help="folder to write into (default: the scene's own)",
    )
    options = parser.parse_args(arguments)
    try:
        print(write(Request(options.triangles, options.seed, options.output)))
    except OSError as error:
        parser.exit(1, f"{parser.prog}: cannot write into {options.output}: {error}\n")
