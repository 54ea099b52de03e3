"""Curves of error over time, of both renderers, as the plots of all pages draw them."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

COLOURS = ("#d95f02", "#3465a4")
LABEL_PLACES = (((-4, -4), "right", "top"), ((5, 4), "left", "bottom"))
"""Where the numbers of samples stand: those of the first renderer, mostly the faster one,
to the left and below, so that they do not meet those of the other where the curves do."""
STEPS = ((1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
"""Multiples of powers of ten at which times are written, in few places or in more."""
ONE_DECADE = 10.0


def draw_error_curves(
    axes: Axes, sides: Sequence[dict[str, Any]], *, label_size: float
) -> None:
    """MSE over milliseconds of a frame, both logarithmic.

    sides: of the figures of `mlrt-compare speed-error`. Bars go from quartile to quartile
    of the times; numbers beside the points are samples a pixel.
    """
    times: list[float] = []
    for side, colour, (offset, across, along) in zip(
        sides, COLOURS, LABEL_PLACES, strict=True
    ):
        points = side["points"]
        low, medians, high = zip(*(quartiles(point) for point in points), strict=True)
        errors = [point["mse"] for point in points]
        times += medians
        axes.errorbar(
            medians,
            errors,
            xerr=[
                [m - x for m, x in zip(medians, low, strict=True)],
                [x - m for m, x in zip(medians, high, strict=True)],
            ],
            marker="o",
            markersize=4,
            linewidth=1.5,
            color=colour,
            label=side["name"],
        )
        for point, time in zip(points, medians, strict=True):
            axes.annotate(
                f"{point['spp']}",
                (time, point["mse"]),
                textcoords="offset points",
                xytext=offset,
                ha=across,
                va=along,
                fontsize=label_size,
                color=colour,
            )
    axes.set(xscale="log", yscale="log")
    axes.margins(0.09)
    write_plain_times(axes, max(times) / min(times))
    axes.grid(True, which="both", alpha=0.25)


def quartiles(point: dict[str, Any]) -> tuple[float, float, float]:
    """Of the times of a frame, in milliseconds; the second is the median."""
    low, _, high = statistics.quantiles(point["seconds"], n=4, method="inclusive")
    return 1e3 * low, 1e3 * point["median"], 1e3 * high


def write_plain_times(axes: Axes, span: float) -> None:
    """Plain numbers along the x axis, so far apart that they do not overlap.

    span: the greatest time over the least.
    """
    steps = STEPS[span < ONE_DECADE]
    axes.xaxis.set_major_locator(LogLocator(10, subs=steps))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_minor_formatter(NullFormatter())


def scene_name(scene: str | Path) -> str:
    """What a scene is called: its file, or its folder where the file is called `scene`, and
    in brackets what else that is called, as in `scene_direct`."""
    path = Path(scene)
    if not path.stem.startswith("scene"):
        return path.stem
    kind = path.stem.removeprefix("scene").strip("_-")
    return f"{path.parent.name} ({kind})" if kind else path.parent.name
