"""mlrt-compare ztest: the test that Mitsuba judges its own renders by."""

from __future__ import annotations

import argparse
import dataclasses
import math
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mlrt_files import put_in_place

from .options import (
    COULD_NOT_RUN,
    FAILED,
    PASSED,
    PROGRAM,
    CannotRun,
    Parser,
    add_output_options,
    add_scene_choices,
    add_table,
    at_least,
    check_json,
    check_output_folder,
    settings_of,
    write_json,
    write_text,
)
from .scene_files import common_folder, scenes_in, told_from
from .settings import Settings
from .shading_paths import on_each_path

if TYPE_CHECKING:
    from .scalar_reference import Reference
    from .ztest import ZTest

SAMPLE_BUDGET = 2_000_000
"""Samples of an image that is tested, as in Mitsuba's own tests."""
REFERENCE_FACTOR = 64
"""Samples of a reference over those of the image: its noise then adds less than 1 % to the
standard score."""


@dataclass(frozen=True)
class Judged:
    """An image and what the test says of it, or why it could not be tested."""

    name: str
    test: ZTest | None = None
    reference: Reference | None = None
    error: str = ""
    path: str = ""
    """Who shades: native or mitsuba."""
    integrator: str = ""
    """What was asked for in place of the scene's integrator, with its samples."""
    asks_for_more: str = ""
    """What the scene's integrator computes besides direct light."""
    seconds: float = math.nan
    """Of rendering the image."""
    notes: tuple[str, ...] = ()

    @property
    def code(self) -> int:
        """The exit code for this image: the rule of Mitsuba's tests decides."""
        if self.test is None:
            return COULD_NOT_RUN
        return PASSED if self.test.pixels_pass else FAILED

    def text(self) -> str:
        test, reference = self.test, self.reference
        if test is None or reference is None:
            return f"{self.name}: {self.error}"
        name = f"{self.name}, {self.path}" if self.path else self.name
        known = f", {reference.spp:.0f} spp" if math.isfinite(reference.spp) else ""
        return (
            f"{'PASS' if test.pixels_pass else 'FAIL'} {name}: "
            f"{100 * test.passing:.4f} % of the pixels' channels pass, smallest p "
            f"{test.smallest_p:.2g} at alpha {test.alpha:.2g}, of the mean "
            f"{test.mean_p:.2g}; {test.spp} spp against {reference.source}{known}"
        )

    def as_dict(self) -> dict[str, Any]:
        """All figures; JSON has None for those that are not finite."""
        figures: dict[str, Any] = {"name": self.name, "code": self.code}
        for name in ("path", "integrator", "asks_for_more"):
            if getattr(self, name):
                figures[name] = getattr(self, name)
        if self.test is None or self.reference is None:
            return {**figures, "error": self.error}
        figures["reference"] = self.reference.source
        figures["reference_spp"] = self.reference.spp
        figures["seconds"] = self.seconds
        figures["notes"] = list(self.notes)
        return {**figures, **self.test.as_dict()}


def run(arguments: Sequence[str]) -> int:
    """Runs the command and returns its exit code, the worst of all scenes. Raises
    CannotRun."""
    options = ztest_parser().parse_args(arguments)
    if options.output is not None:
        check_output_folder(options.output)
    check_json(options.json)
    check_json(options.table)
    images = [path for path in options.inputs if path.suffix.lower() == ".exr"]
    if not images:
        judged = judge_scenes(options)
    elif len(images) == len(options.inputs) == 3:
        judged = [judge_images(options)]
        write_json(options.json, [one.as_dict() for one in judged])
    else:
        raise CannotRun(
            "name scenes, or three EXR files: the image, the reference and the variance of "
            "a sample"
        )
    if options.output is not None:
        write_p_maps(judged, options.output)
    return max(
        (one.code for one in judged if one.test or Path(one.name) in options.inputs),
        default=COULD_NOT_RUN,
    )


def judge_images(options: argparse.Namespace) -> Judged:
    """Tests an EXR file. Raises CannotRun."""
    if options.spp is None:
        raise CannotRun("tell how many samples a pixel the image has: --spp N")
    from .exr_files import COLOUR, check_comparable, common_channels, read_exr
    from .scalar_reference import reference_of_files, to_xyz
    from .ztest import z_test

    image, expected = read_exr(options.inputs[0]), read_exr(options.inputs[1])
    check_comparable(image, expected)
    common_channels(image, image, COLOUR)
    reference = reference_of_files(*options.inputs[1:])
    test = z_test(
        to_xyz(image.stack(COLOUR)), reference.mean, reference.variance, options.spp
    )
    return told(Judged(str(options.inputs[0]), test, reference))


def judge_scenes(options: argparse.Namespace) -> list[Judged]:
    """Renders and tests each scene; one that cannot be rendered does not stop the
    others. What is known is written after each of them."""
    from mlrt_plugin.errors import MlrtError

    found: list[Judged] = []
    scenes = scenes_in(options.inputs)
    for scene in scenes:
        try:
            for settings in settings_of_paths(options, scene):
                found.append(judge_scene(settings, options))
        except (MlrtError, CannotRun) as error:
            print(f"{PROGRAM}: {error}", file=sys.stderr)
            found.append(Judged(str(scene), error=str(error)))
        more_to_come = scene is not scenes[-1]
        rows = told_from([one.as_dict() for one in found], common_folder(scenes))
        write_json(options.json, rows, more_to_come=more_to_come)
        write_text(options.table, table(rows), more_to_come=more_to_come)
    return found


def settings_of_paths(options: argparse.Namespace, scene: Path) -> list[Settings]:
    """What to render of a scene: once, or by each path that can. Raises MlrtError for a
    scene that cannot be read."""
    settings = settings_of(options, scene, options.spp)
    if not options.each_path:
        return [settings]
    return on_each_path(dataclasses.replace(settings, shading=None))[0]


def judge_scene(settings: Settings, options: argparse.Namespace) -> Judged:
    """Renders a scene by MLRT and holds it against a reference that is stored, kept or
    rendered. Raises MlrtError or CannotRun."""
    from mlrt_plugin.progress import ProgressBar
    from mlrt_plugin.threads import thread_count

    from .mlrt_renderer import MlrtRenderer
    from .reference_cache import ReferenceCache
    from .scalar_reference import rendered_reference, stored_reference, to_xyz
    from .ztest import z_test

    cache = ReferenceCache(options.cache)
    with thread_count(settings.threads):
        renderer = MlrtRenderer(settings)
        notes = (*renderer.warnings, *warnings_of_filter(settings))
        for warning in notes:
            print(f"{PROGRAM}: warning: {warning}", file=sys.stderr)
        spp = settings.spp
        if spp is None:
            renderer.frame(spp=1)
            height, width = renderer.image.shape[:2]
            spp = max(1, SAMPLE_BUDGET // (height * width))
        seconds = renderer.frame(spp=spp)
        image = renderer.image
        reference = None if settings.resolution else stored_reference(settings.scene)
        if reference is None:
            with ProgressBar(f"reference of {settings.scene.name}") as bar:
                reference = rendered_reference(
                    settings,
                    options.reference_spp or options.reference_factor * spp,
                    cache,
                    integrator=renderer.integrator,
                    authored=options.authored,
                    progress=bar,
                )
    if reference.mean.shape != image.shape:
        raise CannotRun(
            f"the reference of {settings.scene} has the shape {reference.mean.shape} and "
            f"the image {image.shape}"
        )
    test = z_test(to_xyz(image), reference.mean, reference.variance, spp)
    return told(
        Judged(
            str(settings.scene),
            test,
            reference,
            path="mitsuba" if renderer.by_mitsuba else "native",
            integrator=named(renderer.integrator),
            asks_for_more=renderer.missing,
            seconds=seconds,
            notes=notes,
        )
    )


def named(integrator: dict[str, Any]) -> str:
    """An integrator of Mitsuba and its numbers of samples, in words."""
    counts = [str(n) for name, n in integrator.items() if name.endswith("_samples")]
    return " + ".join([str(integrator["type"]), *counts]).replace(" + ", " ", 1)


def table(rows: Sequence[dict[str, Any]]) -> str:
    """All tests as Markdown, of the figures of each."""
    lines = [
        "| scene | path | samples | asks for more | spp | reference, spp "
        "| pixels' channels that pass (%) | smallest p | p of the mean | seconds | |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]
    skipped = []
    for row in rows:
        if "error" in row:
            skipped.append(f"- {row['name']}: {row['error']}")
            continue
        known = row["reference_spp"]
        lines.append(
            f"| {row['name']} | {row['path']} | {row['integrator']} "
            f"| {row.get('asks_for_more', 'no')} | {row['spp']} "
            f"| {row['reference']}{f', {known:.0f}' if math.isfinite(known) else ''} "
            f"| {100 * row['passing_share']:.4f} | {row['smallest_p']:.2g} "
            f"| {row['mean_p']:.2g} | {row['seconds']:.2g} "
            f"| {'pass' if row['pixels_pass'] else 'FAIL'} |"
        )
    if skipped:
        lines += ["", "Not judged:", "", *skipped]
    return "\n".join(lines) + "\n"


def warnings_of_filter(settings: Settings) -> list[str]:
    """What to say of a film whose pixels share samples."""
    from mlrt_plugin.parsing import parse_file

    root = parse_file(settings.scene, settings.defines).root
    sensors = list(root.children_of("sensor"))
    films = sensors[settings.sensor].children_of("film") if sensors else ()
    filters = [child.plugin for film in films for child in film.children_of("rfilter")]
    plugin = filters[0] if filters else "gaussian"
    if plugin == "box":
        return []
    return [
        f"{settings.scene}: pixels share samples by the film's filter {plugin}, so that "
        "the test is too lenient; a box filter makes it right"
    ]


def told(judged: Judged) -> Judged:
    """Prints what a test says, and returns it."""
    print(judged.text())
    return judged


def write_p_maps(judged: Sequence[Judged], folder: Path) -> None:
    """Writes STEM-p.png for each image that was tested; all or none."""
    from PIL import Image as Pillow

    from .image_maps import p_map

    folder.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".mlrt-compare-") as temporary:
        unfinished: list[Path] = []
        for one in judged:
            if one.test is not None:
                stem = Path(one.name).stem
                path = Path(temporary) / f"{stem}-p.png"
                # Scenes in folders of their own are often called alike.
                if path in unfinished:
                    path = path.with_name(f"{stem}-{len(unfinished) + 1}-p.png")
                picture = p_map(one.test.p_values, one.test.alpha)
                Pillow.fromarray(picture).save(path)
                unfinished.append(path)
        for path in unfinished:
            print(f"wrote {put_in_place(path, folder / path.name)}")


def ztest_parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog=f"{PROGRAM} ztest",
        description="Renders scenes with MLRT and tests each pixel against its expected "
        "value by the z-test, significance and pass rule of Mitsuba's own image tests. "
        "References are those beside the scene (refs/NAME_ref_rgb.exr and _var.exr), else "
        "they are rendered by Mitsuba's scalar_rgb and kept. Or tests an EXR file.",
        epilog="Exit codes: 0 all pass, 2 one fails, 4 one could not be tested. The "
        "p-value of the image's mean is told, but is no part of Mitsuba's rule.",
    )
    parser.add_argument(
        "inputs",
        type=Path,
        nargs="+",
        metavar="SCENE|FOLDER|IMAGE",
        help="XML files, or folders of such; or three EXR files, with --spp: image, "
        "reference, variance of a sample",
    )
    add_scene_choices(parser)
    parser.add_argument(
        "--spp",
        type=at_least(1),
        help=f"samples a pixel of what is tested ({SAMPLE_BUDGET} by the number of pixels)",
    )
    parser.add_argument(
        "--reference-spp",
        type=at_least(1),
        metavar="N",
        help="samples a pixel of a reference that is rendered",
    )
    parser.add_argument(
        "--reference-factor",
        type=at_least(1),
        default=REFERENCE_FACTOR,
        metavar="N",
        help="the same, in samples of what is tested (%(default)s); the test knows the "
        "noise of both",
    )
    parser.add_argument(
        "--each-path",
        action="store_true",
        help="test the image of each path that can render a scene, native and mitsuba",
    )
    add_table(parser)
    parser.add_argument(
        "--authored",
        action="store_true",
        help="render references by the scene's own integrator, whose variance then counts, "
        "in place of direct with as many samples as MLRT takes",
    )
    parser.add_argument(
        "--cache",
        type=Path,
        metavar="DIR",
        help="folder that references are kept in (~/.cache/mlrt-compare)",
    )
    add_output_options(parser, "maps of the p-values as PNG")
    return parser
