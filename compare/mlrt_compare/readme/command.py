"""The command `mlrt-bench readme`."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from mlrt_files import replacing

from ..bench.checkout import find_checkout
from ..bench.errors import BenchError
from ..bench.figures import show
from .page import Page, page_of, spliced


def run(options: argparse.Namespace) -> bool:
    """Writes what differs from the figures, or with ``check`` tells it; returns whether
    nothing is left that does."""
    source = find_checkout(options.source)
    readme = source / "README.md"
    try:
        page = page_of(source)
        text = spliced(readme.read_text(encoding="utf-8"), page.text)
        stale = [picture for picture in page.pictures if not picture.is_current()]
        if options.check:
            return told(page, text == readme.read_text(encoding="utf-8"), stale)
        for picture in stale:
            picture.path.parent.mkdir(exist_ok=True)
            with replacing(picture.path) as temporary:
                temporary.write_bytes(picture.draw())
        with replacing(readme) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise BenchError(f"{error.filename} {error.strerror}") from error
    written = [readme, *(picture.path for picture in stale)]
    show(["wrote " + ", ".join(str(path.relative_to(source)) for path in written)])
    return True


def told(page: Page, same: bool, stale: Sequence[object]) -> bool:
    """Shows a line for each thing that is out of step; returns whether there is none."""
    lines = [] if same else ["README.md is not what the figures say"]
    lines += [
        f"{picture.path} is not drawn from the figures"
        for picture in page.pictures
        if picture in stale
    ]
    if lines:
        lines.append("draw it anew: mlrt-bench readme")
    show(lines or ["README.md and its pictures are what the figures say"])
    return not lines
