"""The command mlrt-bench.

Exit codes: 0 done, 2 images that must agree do not, 4 the benchmark could not be made, 130
interrupted. With ``MLRT_DEBUG`` set in the environment, errors come with a traceback.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from .errors import BenchError
from .options import (
    Parser,
    add_sample_counts,
    add_shared_options,
    add_source_option,
    add_study_options,
    check_folder_of,
    check_json,
    check_plot,
    check_threads,
    count,
    names,
    settings_of_tracing,
    sizes,
)
from .status import show_status

DONE, DISAGREE, COULD_NOT_RUN, INTERRUPTED = 0, 2, 4, 130
PROGRAM = "mlrt-bench"


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the command and returns its exit code. ``argv`` is without the program's
    name."""
    try:
        options = make_parser().parse_args(argv)
        run: Callable[[argparse.Namespace], bool] = options.run
        check_json(options.json)
        threads = options.threads
        check_threads([threads] if isinstance(threads, int) else threads)
        return DONE if run(options) else DISAGREE
    except BenchError as error:
        print(f"{PROGRAM}: {error}", file=sys.stderr)
        return COULD_NOT_RUN
    except KeyboardInterrupt:
        show_status("")
        print(f"{PROGRAM}: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if os.environ.get("MLRT_DEBUG"):
            raise
        message = " ".join(str(error).split())
        print(f"{PROGRAM}: {type(error).__name__}: {message}", file=sys.stderr)
        return COULD_NOT_RUN


def make_parser() -> Parser:
    parser = Parser(
        prog=PROGRAM,
        description="Benchmarks of MLRT beside Embree 3 of the mitsuba wheel, in one "
        "process and in turns. The native side is compiled when it is first needed.",
        epilog="Exit codes: 0 done, 2 images that must agree do not, 4 could not run.",
    )
    commands = parser.add_subparsers(dest="command", required=True, parser_class=Parser)
    build = commands.add_parser(
        "build",
        help="seconds and bytes of trees and of the first frame with them",
        description="Builds MLRT's trees and Embree's hierarchies and renders a frame with "
        "each.",
    )
    build.set_defaults(run=run_build)
    add_shared_options(build, repeats=5)
    build.add_argument(
        "--images", type=Path, metavar="DIR", help="write the frames of both engines there"
    )
    rays = commands.add_parser(
        "rays",
        help="primary and shadow rays by MLRT and by Embree in each of its modes",
        description="Traces the same primary and shadow rays with MLRT and with Embree in "
        "each of its modes; the frame counts whole: rays made, traced, shaded and stored.",
    )
    rays.set_defaults(run=run_rays)
    add_shared_options(rays, repeats=9)
    add_sample_counts(rays)
    rays.add_argument(
        "--tiles",
        type=sizes,
        default=(16, 32, 64, 128),
        metavar="N,M",
        help="sides of tiles in rays, of which each contender has its best (16,32,64,128)",
    )
    rays.add_argument(
        "--trace",
        type=settings_of_tracing,
        default={},
        metavar="KEY=VALUE,...",
        help="how MLRT traces, such as traversal=interval,minimum_tile=16 (as usual)",
    )
    rays.add_argument(
        "--same-isa",
        action="store_true",
        help="limit Embree to MLRT's instruction set, that of MLRT_ISA in the environment "
        "or the best of the machine",
    )
    rays.add_argument(
        "--inexact",
        action="store_true",
        help="measure MLRT that trusts single precision too, and such that trusts it in "
        "distances alone, to tell what exactness and watertightness cost",
    )
    frames = commands.add_parser(
        "frames",
        help="whole frames by MLRT and by Mitsuba's llvm variant",
        description="Renders the same image with MLRT and with the integrator direct of "
        "Mitsuba's llvm_ad_rgb, from the loaded scene to the finished film.",
    )
    frames.set_defaults(run=run_frames)
    add_shared_options(frames, repeats=7, scenes="office,conference")
    add_sample_counts(frames)
    tiles = commands.add_parser(
        "tiles",
        help="frames with tiles of other sizes",
        description="Traces the frame of `rays` with MLRT, over the paper's range of ITS, "
        "MTS and split factors, and sets the time beside that with the usual tiles. On one "
        "thread, whatever --threads says.",
    )
    tiles.set_defaults(run=run_tiles)
    add_shared_options(tiles, repeats=5)
    add_sample_counts(tiles)
    turns = commands.add_parser(
        "turns",
        help="rays by this checkout and by another commit of it",
        description="Traces the frame of `rays` with MLRT as it is in the checkout and as "
        "another commit has it, in turns, and tells the ratios of the times and the rays "
        "that hit something else. The exit code is 2 if camera rays do.",
    )
    turns.set_defaults(run=run_turns)
    turns.add_argument(
        "base", metavar="COMMIT", help="what the checkout is compared with, by any name"
    )
    add_shared_options(turns, repeats=20)
    add_sample_counts(turns)
    order = commands.add_parser(
        "order",
        help="nanoseconds a ray by the order that rays are given in",
        description="Traces arrays of rays with MLRT's closest_hit and with Embree: those "
        "of the camera line by line, in Morton order and shuffled, and rays from what they "
        "hit in random directions.",
    )
    order.set_defaults(run=run_order)
    add_shared_options(order, repeats=5, scenes="office,conference")
    features = commands.add_parser(
        "features",
        help="what features cost that a picture does not use",
        description="Renders scenes in turns with a small shape out of sight that is plain "
        "or has a texture, vertex normals, a mask or a light, and compares the time of the "
        "processor. On the first number of threads.",
    )
    features.set_defaults(run=run_features)
    add_shared_options(features, repeats=30, scenes="office,cornell-box")
    features.add_argument(
        "--spp", type=count, default=4, metavar="N", help="samples a pixel (%(default)s)"
    )
    watertight = commands.add_parser(
        "watertight",
        help="rays at vertices and edges of closed meshes, of which none may escape",
        description="Traces rays from inside of closed meshes at their vertices and edges "
        "with MLRT and with Embree in its default and its robust mode, and counts those "
        "that find nothing. The exit code is 2 if MLRT loses one.",
    )
    watertight.set_defaults(run=run_watertight)
    add_study_options(watertight, rays=10**9)
    watertight.add_argument(
        "--meshes",
        type=names,
        metavar="A,B",
        help="sphere, slivers, bunny, dragon, one of them with ' at 10^6' added, or an "
        "XML file (all usual ones)",
    )
    watertight.add_argument(
        "--continue",
        dest="resume",
        action="store_true",
        help="keep the meshes that the file of --json has, and trace the others only",
    )
    hits = commands.add_parser(
        "hits",
        help="adversarial rays against exact arithmetic",
        description="Traces rays that rounding makes tracers fail on, in small scenes, "
        "with MLRT and with Embree in its default and its robust mode, and counts the hits "
        "that exact arithmetic does not confirm. The exit code is 2 if MLRT has one.",
    )
    hits.set_defaults(run=run_hits)
    add_study_options(hits, rays=10**6)
    kernels = commands.add_parser(
        "kernels",
        help="exact tests of triangles beside such in single and double precision",
        description="Traces rays from inside of closed meshes with the same traversal and "
        "five tests of triangles, in each way that MLRT has, and with Embree in its "
        "default and its robust mode, and counts leaks, wrong hits, hits of other faces "
        "and errors of t.",
    )
    kernels.set_defaults(run=run_kernels)
    add_shared_options(kernels, repeats=5)
    kernels.add_argument(
        "--rays",
        type=ray_count,
        default=2**20,
        metavar="N",
        help="of each kind (%(default)s)",
    )
    kernels.add_argument(
        "--subdivisions",
        type=int,
        choices=range(1, 11),
        default=7,
        metavar="N",
        help="of the meshes, 1 to 10: 8 * 4**N faces (%(default)s)",
    )
    kernels.add_argument(
        "--markdown", type=Path, metavar="FILE", help="write all tables there"
    )
    kernels.add_argument(
        "--plot", type=Path, metavar="FILE", help="draw speed against errors there"
    )
    offsets = commands.add_parser(
        "offsets",
        help="pixels that shadow rays get wrong, by size of the scene",
        description="Renders a scene of thin walls and narrow gaps, from a millionth to a "
        "million times its size and away from the origin, with each offset of shadow rays, "
        "and counts the pixels that see a light where double precision says otherwise. No "
        "times are taken.",
    )
    offsets.set_defaults(run=run_offsets, threads=(1,))
    offsets.add_argument(
        "--json", type=Path, metavar="FILE", help="write all figures there"
    )
    offsets.add_argument(
        "--images", type=Path, metavar="DIR", help="write images with marks on such pixels"
    )
    offsets.add_argument(
        "--resolution",
        type=count,
        default=128,
        metavar="N",
        help="pixels along both sides of the image (%(default)s)",
    )
    add_source_option(offsets)
    readme = commands.add_parser(
        "readme",
        help="the results that README.md shows, from the figures that are kept",
        description="Draws tables and pictures of the results in README.md from the "
        "figures in compare/results. Nothing is measured.",
    )
    readme.set_defaults(run=run_readme, json=None, threads=(1,))
    readme.add_argument(
        "--check",
        action="store_true",
        help="write nothing; the exit code is 2 if anything is not what the figures say",
    )
    add_source_option(readme)
    return parser


def ray_count(text: str) -> int:
    limit = 2**28
    value = int(text) if text.isdecimal() else 0
    if not 1 <= value <= limit:
        raise argparse.ArgumentTypeError(f"{text} is not from 1 to {limit}")
    return value


# What the commands need is imported late: a wrong call is answered without loading Mitsuba.


def run_build(options: argparse.Namespace) -> bool:
    if options.images is not None:
        check_folder_of(options.images)
        if options.images.is_file():
            raise BenchError(f"{options.images} to write images to is not a folder")
    from .build_command import run

    return run(options)


def run_rays(options: argparse.Namespace) -> bool:
    from .rays_command import run

    return run(options)


def run_tiles(options: argparse.Namespace) -> bool:
    from .tiles_command import run

    return run(options)


def run_turns(options: argparse.Namespace) -> bool:
    from .turns_command import run

    return run(options)


def run_order(options: argparse.Namespace) -> bool:
    from .order_command import run

    return run(options)


def run_features(options: argparse.Namespace) -> bool:
    from .features_command import run

    return run(options)


def run_watertight(options: argparse.Namespace) -> bool:
    from .watertight_command import run

    return run(options)


def run_hits(options: argparse.Namespace) -> bool:
    from .hits_command import run

    return run(options)


def run_kernels(options: argparse.Namespace) -> bool:
    if options.markdown is not None:
        check_folder_of(options.markdown)
    if options.plot is not None:
        check_plot(options.plot)
        need_package("matplotlib")
    from .kernels_command import run

    return run(options)


def run_offsets(options: argparse.Namespace) -> bool:
    if options.images is not None:
        check_folder_of(options.images)
        if options.images.is_file():
            raise BenchError(f"{options.images} to write images to is not a folder")
    from .offsets_command import run

    return run(options)


def run_readme(options: argparse.Namespace) -> bool:
    need_package("matplotlib")
    need_package("PIL")
    from ..readme.command import run

    return run(options)


def need_package(name: str) -> None:
    """Raises BenchError unless what plots and pictures need is installed."""
    if importlib.util.find_spec(name) is None:
        raise BenchError(f"plots need the package {name}: pip install 'mlrt[compare]'")


def run_frames(options: argparse.Namespace) -> bool:
    from .. import llvm

    # Dr.Jit takes its libLLVM when it is first imported, which the command does.
    try:
        library = llvm.activate()
    except llvm.LlvmUnavailable as error:
        raise BenchError(str(error)) from error
    from .frames_command import run

    return run(options, library)
