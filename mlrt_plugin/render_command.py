"""The command ``mlrt render``: one image for each scene and sensor that is named."""

from __future__ import annotations

import argparse
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from .errors import MlrtError, OutputError, one_sentence
from .image_files import check_output, write_image
from .integrators import own_aovs
from .options import AOVS, SHADOW_OFFSETS
from .progress import ProgressBar
from .render import checked_seed, prepare
from .samplers import checked_spp
from .scene_import import summarise
from .shading_choice import SHADINGS
from .threads import thread_count
from .tree_command import add_build_options, add_tree_cache, build_options_of

NO_MEMORY = (
    "there is not enough memory for the scene: close other programs, raise the limit that "
    "'ulimit -v' shows, or take a smaller scene"
)


class SomeFailed(Exception):
    """Images that could not be made; each has been complained of already."""


@dataclass(frozen=True)
class Job:
    """One image."""

    scene: Path
    sensor: int
    output: Path

    def __str__(self) -> str:
        return f"{self.scene} (sensor {self.sensor})" if self.sensor else str(self.scene)


def file_path(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("the name of the file is empty")
    return Path(text)


def resolution(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text)
    if not match or "0" in (match[1].lstrip("0") or "0", match[2].lstrip("0") or "0"):
        raise argparse.ArgumentTypeError(f"'{text}' is not a size such as 640x480")
    return int(match[1]), int(match[2])


def aov_names(text: str) -> tuple[str, ...]:
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",")))
    for name in names:
        if name not in AOVS:
            raise argparse.ArgumentTypeError(
                f"'{name}' does not exist, choose from {', '.join(AOVS)}"
            )
    return names


def sensor_numbers(text: str) -> tuple[int, ...] | None:
    """The numbers that are given; None for all."""
    if text == "all":
        return None
    try:
        return tuple(dict.fromkeys(int(number) for number in text.split(",")))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}' is no number of a sensor, nor several such as 0,1, nor all"
        ) from None


def add_render_options(render: argparse.ArgumentParser) -> None:
    render.add_argument(
        "scenes", type=file_path, nargs="+", metavar="SCENE", help="a Mitsuba XML file"
    )
    render.add_argument(
        "-s",
        "--sensor",
        type=sensor_numbers,
        default=(0,),
        metavar="N[,N]...|all",
        help="number of the sensor, from 0; an image for each if there are several",
    )
    render.add_argument(
        "-o",
        "--output",
        type=file_path,
        help="image to write, .exr or .png (default: beside the scene, .exr); with several "
        "scenes the folder for their images",
    )
    render.add_argument("-t", "--threads", type=int, help="threads (default: all)")
    render.add_argument("--spp", type=int, help="samples per pixel (default: the scene's)")
    render.add_argument("--seed", type=int, default=0, help="of the random numbers")
    render.add_argument("--resolution", type=resolution, metavar="WxH", help="in pixels")
    render.add_argument(
        "--aov",
        type=aov_names,
        default=(),
        metavar="NAMES",
        help=f"further channels, separated by commas: {', '.join(AOVS)}",
    )
    add_shading(render)
    render.add_argument(
        "--force-direct",
        action="store_true",
        help="render direct illumination where the scene's integrator asks for more",
    )
    render.add_argument(
        "--shadow-offset",
        choices=SHADOW_OFFSETS,
        help="how shadow rays are kept off surfaces: by Mitsuba's formula, or by a bound "
        "of the error, for scenes of any size (default: the scene's, else mitsuba)",
    )
    add_tree_cache(render)
    add_build_options(render, ["builder"])


def add_shading(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--shading",
        choices=SHADINGS,
        help="who shades: this program, or Mitsuba's plugins on its hits (default: what "
        "the scene says, else auto, which takes Mitsuba's where the scene needs them)",
    )


def jobs_of(arguments: argparse.Namespace) -> list[Job]:
    """The images to make, their names derived where they are not given.

    Raises OutputError if two of them would have the same name.
    """
    chosen = [(scene, sensors_of(scene, arguments)) for scene in arguments.scenes]
    several = sum(len(sensors) for _, sensors in chosen) > 1
    jobs = []
    for scene, sensors in chosen:
        for sensor in sensors:
            several_sensors = len(sensors) > 1
            stem = scene.stem or "scene"  # a folder that will be complained of
            name = f"{stem}-{sensor}.exr" if several_sensors else f"{stem}.exr"
            output = scene.parent / name
            if several and arguments.output is not None:
                output = arguments.output / name
            elif arguments.output is not None:
                output = arguments.output
            jobs.append(Job(scene, sensor, output))
    if several and arguments.output is not None and not arguments.output.is_dir():
        raise OutputError(
            f"output '{arguments.output}' is for several images and must be a folder that "
            "exists: create it first"
        )
    by_output: dict[Path, Job] = {}
    for job in jobs:
        other = by_output.setdefault(Path(os.path.realpath(job.output)), job)
        if other is not job:
            raise OutputError(
                f"{other} and {job} would both be written to '{job.output}': render them "
                "in calls of their own"
            )
    return jobs


def sensors_of(scene: Path, arguments: argparse.Namespace) -> tuple[int, ...]:
    """The numbers of the sensors of a scene that are asked for. Of a scene that cannot be
    parsed this is the first, which will then be complained of."""
    if arguments.sensor is not None:
        numbers: tuple[int, ...] = arguments.sensor
        return numbers
    try:
        count = summarise(scene, defines=dict(arguments.define)).sensor_count
    except MlrtError:
        return (0,)
    return tuple(range(max(1, count)))


def run_render(arguments: argparse.Namespace) -> None:
    """Makes the images. Where there are several, one that fails is complained of and the
    others are made; SomeFailed is raised in the end."""
    jobs = jobs_of(arguments)
    if arguments.spp is not None:
        checked_spp(arguments.spp)
    checked_seed(arguments.seed, 0)
    if len(jobs) == 1:
        render_job(jobs[0], arguments)
        return
    failed = [job for job in jobs if not succeeds(job, arguments)]
    if failed:
        names = ", ".join(map(str, failed))
        raise SomeFailed(f"{len(failed)} of {len(jobs)} images failed: {names}")


def succeeds(job: Job, arguments: argparse.Namespace) -> bool:
    """Makes an image and tells whether that went well; if not, the error is on standard
    error."""
    try:
        render_job(job, arguments)
    except BrokenPipeError:
        raise
    except (MemoryError, Exception) as error:
        print(f"mlrt: error: {complaint(error)}", file=sys.stderr)
        return False
    return True


def complaint(error: BaseException) -> str:
    """What to tell of an error, in one sentence; with ``MLRT_DEBUG`` set in the
    environment, it is raised again."""
    if os.environ.get("MLRT_DEBUG"):
        raise error
    if isinstance(error, MemoryError):
        return NO_MEMORY
    message = one_sentence(str(error))
    if isinstance(error, (ValueError, SomeFailed)):
        return message
    return f"{type(error).__name__}: {message}"


def render_job(job: Job, arguments: argparse.Namespace) -> None:
    """Renders one image and writes it."""
    check_output(job.output, arguments.aov)
    with thread_count(arguments.threads):
        prepared = prepare(
            job.scene,
            sensor=job.sensor,
            defines=dict(arguments.define),
            resolution=arguments.resolution,
            shading=arguments.shading,
            force_direct=arguments.force_direct,
            tree_cache=arguments.tree_cache,
            **build_options_of(arguments),
        )
        check_output(job.output, (*arguments.aov, *own_aovs(prepared.lighting)))
        for message in prepared.warnings:
            print(f"mlrt: warning: {message}", file=sys.stderr)
        if arguments.verbose:
            print(f"shading: {prepared.shading}")
        with ProgressBar("rendering") as progress:
            result = prepared.render(
                spp=arguments.spp,
                seed=arguments.seed,
                aovs=arguments.aov,
                shadow_offset=arguments.shadow_offset,
                progress=progress,
            )
    for message in result.warnings:
        if message not in prepared.warnings:
            print(f"mlrt: warning: {message}", file=sys.stderr)
    write_image(job.output, result.image, result.aovs)
    height, width = result.image.shape[:2]
    seconds = ", ".join(f"{name} {value:.3f} s" for name, value in result.timings.items())
    spp = arguments.spp or prepared.spp
    print(f"{job.output}: {width}x{height}, {spp} spp; {seconds}")
    if arguments.verbose:
        for name, value in {**prepared.report, **result.counters}.items():
            print(f"  {name}: {value}")
