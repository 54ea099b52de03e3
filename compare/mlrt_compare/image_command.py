"""mlrt-compare image A.exr B.exr: how two images differ, in figures, and a verdict."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .metric_names import METRICS
from .options import (
    COULD_NOT_RUN,
    PROGRAM,
    CannotRun,
    Parser,
    add_output_options,
    at_least,
    check_json,
    check_output_folder,
    number,
    percentage,
    write_json,
)


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code, the worst of all pairs. Raises
    CannotRun."""
    options = image_parser().parse_args(arguments)
    if options.output is not None:
        check_output_folder(options.output)
    check_json(options.json)
    if (options.variance is None) != (options.spp is None):
        raise CannotRun("a z-test needs both: --variance FILE and --spp N")
    pairs = pairs_of(options.image, options.reference)
    if len(pairs) > 1 and options.variance is not None:
        raise CannotRun("--variance is of one reference: name two images, not folders")

    from .image_pair import compare_pair

    results = [compare_pair(image, reference, options) for image, reference in pairs]
    figures: list[dict[str, Any]] = []
    for number_of_pair, result in enumerate(results):
        print(("\n" if number_of_pair else "") + result.text())
        figures.append(result.as_dict())
    if options.output is not None:
        from .image_maps import write_maps

        print("wrote " + ", ".join(map(str, write_maps(results, options.output))))
    write_json(options.json, figures[0] if options.reference.is_file() else figures)
    return max(result.verdict.code for result in results)


def pairs_of(image: Path, reference: Path) -> list[tuple[Path, Path]]:
    """The images to compare: two files, or those of the same name in two folders.

    Raises CannotRun if a folder is empty or lacks an image of the other one.
    """
    for path in (image, reference):
        if not path.exists():
            raise CannotRun(f"the image {path} does not exist: check its path")
    if image.is_dir() != reference.is_dir():
        raise CannotRun(
            f"{image if image.is_dir() else reference} is a folder and the other is not: "
            "name two images or two folders"
        )
    if not image.is_dir():
        return [(image, reference)]
    names = [{path.name for path in folder.glob("*.exr")} for folder in (image, reference)]
    for folder, found in zip((image, reference), names, strict=True):
        if not found:
            raise CannotRun(f"the folder {folder} holds no EXR image")
    for folder, missing in ((image, names[1] - names[0]), (reference, names[0] - names[1])):
        if missing:
            raise CannotRun(f"the folder {folder} lacks {', '.join(sorted(missing))}")
    return [(image / name, reference / name) for name in sorted(names[0])]


def image_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=f"{PROGRAM} image",
        description="Compares an EXR image with a reference, or all images of a folder "
        "with those of the same names in another.",
        epilog="Exit codes, those of idiff: 0 pass, 1 warning, 2 failure, "
        f"{COULD_NOT_RUN} could not run. Metrics: abs (the largest difference), "
        "mean_abs, rmse, relmse, smape, energy (error of the mean), psnr, ssim, flip. "
        "Pixels may differ by 1e-6, unless --fail-if, --warn-if or --variance is given.",
    )
    parser.add_argument("image", type=Path, metavar="IMAGE", help="what is judged")
    parser.add_argument(
        "reference", type=Path, metavar="REFERENCE", help="what it is held against"
    )
    parser.add_argument(
        "--channels",
        type=channels,
        metavar="A,B",
        help="channels to compare (all, which both must have)",
    )
    for word, adverb in (("fail", "failure"), ("warn", "warning")):
        parser.add_argument(
            f"--{word}",
            type=number,
            metavar="X",
            help=f"{adverb} if more pixels than allowed differ by more than X",
        )
        parser.add_argument(
            f"--{word}percent",
            type=percentage,
            default=0.0,
            metavar="P",
            help=f"percentage of the pixels that may differ by more than --{word} (0)",
        )
        parser.add_argument(
            f"--hard{word}",
            type=number,
            default=math.inf,
            metavar="X",
            help=f"{adverb} if any pixel differs by more than X",
        )
        parser.add_argument(
            f"--{word}-if",
            type=metric_limit,
            action="append",
            default=[],
            metavar="METRIC=X",
            help=f"{adverb} if a metric is worse than X; may be repeated",
        )
    parser.add_argument(
        "--variance",
        type=Path,
        metavar="FILE",
        help="EXR with the variance of a single sample, for a z-test",
    )
    parser.add_argument(
        "--spp", type=at_least(1), metavar="N", help="samples a pixel of IMAGE"
    )
    parser.add_argument(
        "--reference-spp",
        type=at_least(1),
        metavar="N",
        help="samples a pixel of REFERENCE (so many that it has no noise)",
    )
    add_output_options(parser, "maps of the difference and of FLIP as PNG")
    return parser


def channels(text: str) -> tuple[str, ...]:
    found = tuple(filter(None, text.split(",")))
    if not found:
        raise argparse.ArgumentTypeError("no channel is named")
    return found


def metric_limit(text: str) -> tuple[str, float]:
    name, equals, value = text.partition("=")
    if not equals or name not in METRICS:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not of the form METRIC=X with one of {', '.join(METRICS)}"
        )
    return name, number(value)
