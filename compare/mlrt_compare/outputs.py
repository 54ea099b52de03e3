"""Writes the images of a comparison, all of them or none."""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image as Pillow

from mlrt_files import put_in_place
from mlrt_plugin.image_files import write_image

from .report import side_by_side
from .run import Comparison


def write_outputs(
    comparison: Comparison, folder: Path, page: str | None = None
) -> list[Path]:
    """Writes STEM-mlrt.exr, STEM-mitsuba.exr, STEM-comparison.png, and STEM-report.html if
    there is a page; returns their paths.

    Makes ``folder`` if its parent exists. Raises OSError if something cannot be written;
    then no image is left behind.
    """
    folder.mkdir(exist_ok=True)
    stem = comparison.settings.scene.stem
    with tempfile.TemporaryDirectory(dir=folder, prefix=".mlrt-compare-") as temporary:
        unfinished = Path(temporary)
        names = [f"{stem}-mlrt.exr", f"{stem}-mitsuba.exr", f"{stem}-comparison.png"]
        write_image(unfinished / names[0], comparison.mlrt.image)
        write_image(unfinished / names[1], comparison.mitsuba.image)
        if comparison.verdict.difference is not None:
            picture = side_by_side(
                comparison.mlrt.image,
                comparison.mitsuba.image,
                (comparison.mlrt.name, comparison.mitsuba.name),
            )
            Pillow.fromarray(picture).save(unfinished / names[2])
        else:
            names.pop()
        if page is not None:
            names.append(f"{stem}-report.html")
            (unfinished / names[-1]).write_text(page, encoding="utf-8")
        return [put_in_place(unfinished / name, folder / name) for name in names]
