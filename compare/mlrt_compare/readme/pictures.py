"""Pictures of README.md. Each carries a digest of what it was drawn from."""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image as Pillow
from PIL import PngImagePlugin

from ..error_plot import draw_error_curves, scene_name

mpl.use("Agg")

PARTS = 4
"""Of the picture of a comparison: both images, their difference, pixels that differ."""
DIGEST = "Figures"
"""Name of the text in a PNG file that the digest is kept in."""
FORMAT = 1
"""Of what is drawn; part of the digest."""


def digest_of(*content: bytes) -> str:
    digest = hashlib.sha256(f"{FORMAT}".encode())
    for part in content:
        digest.update(part)
    return digest.hexdigest()


def kept_digest(path: Path) -> str | None:
    """Of a picture that is there; None if it is not, or has none."""
    try:
        with Pillow.open(path) as picture:
            text = picture.info.get(DIGEST)
    except OSError:
        return None
    return text if isinstance(text, str) else None


@dataclass(frozen=True)
class Pair:
    """Both images out of the picture that `mlrt-compare` writes.

    comparison: that picture. figures: what `--json` wrote with it.
    """

    path: Path
    comparison: Path
    figures: dict[str, Any]

    def digest(self) -> str:
        return digest_of(self.comparison.read_bytes())

    def is_current(self) -> bool:
        return kept_digest(self.path) == self.digest()

    def draw(self) -> bytes:
        """PNG."""
        with Pillow.open(self.comparison) as whole:
            width, height = whole.size
            both = whole.crop((0, 0, 2 * width // PARTS, height))
        text = PngImagePlugin.PngInfo()
        text.add_text(DIGEST, self.digest())
        stream = io.BytesIO()
        both.save(stream, "png", pnginfo=text, optimize=True)
        return stream.getvalue()


@dataclass(frozen=True)
class Plot:
    """A panel of error over time for each scene, of the figures of `speed-error`."""

    path: Path
    figures: list[dict[str, Any]]

    def digest(self) -> str:
        drawn = [
            [
                scene_name(scene["scene"]),
                [
                    [side["name"], [panel_point(point) for point in side["points"]]]
                    for side in scene["sides"]
                ],
            ]
            for scene in self.figures
        ]
        return digest_of(json.dumps(drawn).encode())

    def is_current(self) -> bool:
        return kept_digest(self.path) == self.digest()

    def draw(self) -> bytes:
        """PNG."""
        columns = min(len(self.figures), 2)
        rows = -(-len(self.figures) // columns)
        figure = Figure(figsize=(4.6 * columns, 0.5 + 3.4 * rows), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes in panels[len(self.figures) :]:
            axes.set_visible(False)
        for axes, scene in zip(panels, self.figures, strict=False):
            draw_panel(axes, scene)
        figure.legend(
            *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2
        )
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=110, metadata={DIGEST: self.digest()})
        return stream.getvalue()


def panel_point(point: dict[str, Any]) -> list[Any]:
    """Samples, median and all seconds, and mean squared error."""
    return [point[key] for key in ("spp", "median", "seconds", "mse")]


def draw_panel(axes: Axes, scene: dict[str, Any]) -> None:
    sides = [{**side, "name": side["name"].split()[0]} for side in scene["sides"]]
    draw_error_curves(axes, sides, label_size=7)
    axes.set(xlabel="milliseconds a frame", ylabel="MSE")
    name = scene_name(scene["scene"])
    axes.set_title(f"{name}, numbers are samples a pixel", fontsize=9)
