"""mlrt-compare sweep SCENES...: many comparisons, resumable, on one machine or many."""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .options import (
    COULD_NOT_RUN,
    PROGRAM,
    SEED_LIMIT,
    CannotRun,
    Parser,
    add_choices_of_all,
    at_least,
    check_output_folder,
    resolution,
    settings_with,
    write_json,
)
from .timing import DEFAULT_ROUNDS


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code, the worst of all jobs. Raises
    CannotRun."""
    options = sweep_parser().parse_args(arguments)
    folder: Path = options.output
    check_output_folder(folder)
    from mlrt_plugin.errors import MlrtError

    from .sweep import Job, Results, locally, on_dask, sweep

    jobs = [
        Job(settings_with(options, scene, spp, seed, size), options.rounds)
        for scene, size, spp, seed in itertools.product(
            options.scenes, options.resolution, options.spp, options.seed
        )
    ]
    executor = locally(options.jobs) if options.dask is None else on_dask(options.dask)
    try:
        found = sweep(jobs, Results(folder / "results"), executor, tell)
    except MlrtError as error:
        raise CannotRun(str(error)) from error
    write_json(folder / "sweep.json", found)
    text = table(found, options.jobs if options.dask is None else None)
    (folder / "sweep.md").write_text(text)
    print(f"\n{text}\nwrote {folder / 'sweep.json'}, {folder / 'sweep.md'}")
    return max(int(result["code"]) for result in found)


def tell(name: str, result: dict[str, Any], kept: bool) -> None:
    """A line for each job as it ends."""
    if "error" in result:
        print(f"{PROGRAM}: {name}: {result['error']}", file=sys.stderr)
    else:
        print(f"{name}: {result['verdict']}{' (kept)' if kept else ''}", flush=True)


def table(results: Sequence[dict[str, Any]], at_once: int | None) -> str:
    """All results as Markdown."""
    lines = [
        "| scene | film | spp | seed | MLRT | Mitsuba | ratio | RMSE | verdict |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for result in results:
        if result["code"] == COULD_NOT_RUN:
            lines.append(f"| {result['scene']} | | | | | | | | {result['error']} |")
            continue
        ours, theirs = (side["steady"] for side in result["timings"])
        rmse = (result["difference"] or {}).get("rmse")
        lines.append(
            f"| {result['scene']} | {result['width']} x {result['height']} "
            f"| {result['spp']} | {result['seed']} | {ours:.4g} s | {theirs:.4g} s "
            f"| {theirs / ours:.2f} | {'-' if rmse is None else f'{rmse:.3g}'} "
            f"| {result['verdict']} |"
        )
    if at_once != 1:
        lines += ["", "Times of comparisons that ran at once are not to be published."]
    return "\n".join(lines) + "\n"


def sweep_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=f"{PROGRAM} sweep",
        description="Compares scenes as mlrt-compare SCENE does, with every combination of "
        "sizes, samples and seeds. What is done is kept in the folder, and a sweep that "
        "was ended continues where it was.",
        epilog="Exit codes: 0 all images agree, 2 some do not, 4 some could not run.",
    )
    parser.add_argument(
        "scenes", type=Path, nargs="+", metavar="SCENE", help="Mitsuba 3 XML files"
    )
    parser.add_argument(
        "--spp",
        type=listed(at_least(1)),
        default=(None,),
        metavar="N,M",
        help="samples a pixel (the scene's)",
    )
    parser.add_argument(
        "--seed",
        type=listed(at_least(0, SEED_LIMIT)),
        default=(0,),
        metavar="N,M",
        help="(0)",
    )
    parser.add_argument(
        "--resolution",
        type=listed(resolution),
        default=(None,),
        metavar="WxH,...",
        help="sizes of the film (the scene's)",
    )
    add_choices_of_all(parser)
    parser.add_argument(
        "--rounds", type=at_least(1), default=DEFAULT_ROUNDS, help="timed (%(default)s)"
    )
    parser.add_argument(
        "-j",
        dest="jobs",
        type=at_least(1, 1024),
        default=1,
        metavar="N",
        help="comparisons at once on this machine (1, as they share its processors)",
    )
    parser.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="run on the workers of this Dask scheduler, tcp://HOST:PORT, instead",
    )
    parser.add_argument(
        "-o",
        dest="output",
        type=Path,
        default=Path("sweep"),
        metavar="DIR",
        help="folder for results, made if its parent exists (sweep)",
    )
    return parser


def listed(convert: Any) -> Any:
    """Reads values between commas, each once."""

    def values(text: str) -> tuple[Any, ...]:
        return tuple(dict.fromkeys(convert(part) for part in text.split(",")))

    return values
