"""The report of a comparison: one HTML file that needs no server and no network.

Images are embedded as floats and developed in the browser, so that exposure and error maps
lose nothing.
"""

from __future__ import annotations

import base64
import html
import json
import math
import zlib
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .bench.table import plural
from .metrics import RELATIVE_TOLERANCE
from .options import without_nonfinite
from .run import Comparison
from .validate import MAXIMUM_SHARE

SCRIPTS = ("images.js", "view.js", "main.js")
MIDDLE_GREY = 0.18
"""Linear radiance that the mean of the reference is shown with at first."""


def report_page(
    comparison: Comparison,
    machine: dict[str, Any],
    speed_error: dict[str, Any] | None,
) -> str:
    """The page as text.

    machine: of `machine_record`. speed_error: figures of `mlrt-compare speed-error`, for
    the plot. Raises ValueError if the images differ in size.
    """
    figures = comparison.as_dict()
    cost = comparison.cost
    first, second = comparison.mlrt.image, comparison.mitsuba.image
    if first.shape != second.shape:
        raise ValueError("images of different sizes cannot be shown on one page")
    data = {
        "title": f"{comparison.settings.scene.name}: MLRT and Mitsuba",
        "names": [comparison.mlrt.name, comparison.mitsuba.name],
        "width": first.shape[1],
        "height": first.shape[0],
        "images": [packed(bits(first)), packed(bits(first) ^ bits(second))],
        "cost": None if cost is None else packed(bits(cost)),
        "exposure": first_exposure(second),
        "error_scale": first_error_scale(first, second),
        "passed": figures["passed"],
        "verdict": verdict_text(figures),
        "timings": figures["timings"],
        "timing_notes": timing_notes(comparison),
        "difference": difference_rows(figures),
        "settings": setting_rows(comparison),
        "machine": machine_rows(machine),
        **plot_of(speed_error),
    }
    text = json.dumps(without_nonfinite(data), allow_nan=False)
    page = part("page.html")
    for name, value in (
        ("TITLE", html.escape(str(data["title"]))),
        ("STYLE", part("page.css")),
        ("SCRIPT", "\n".join(map(part, SCRIPTS))),
        # Nothing in the data may end the element that holds it.
        ("DATA", text.replace("<", "\\u003c")),
    ):
        page = page.replace(f"@@{name}@@", value)
    return page


def part(name: str) -> str:
    return (resources.files(__package__) / "page" / name).read_text(encoding="utf-8")


def bits(image: NDArray[np.float32]) -> NDArray[np.uint32]:
    return np.ascontiguousarray(image, np.float32).view(np.uint32).ravel()


def packed(words: NDArray[np.uint32]) -> str:
    """Words as base64 of deflated bytes, plane by plane: the upper bytes are much alike."""
    planes = np.ascontiguousarray(words.astype("<u4").view(np.uint8).reshape(-1, 4).T)
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode()


def first_exposure(reference: NDArray[np.float32]) -> float:
    """Stops, a multiple of a quarter, that make the mean of the reference middle grey."""
    finite = reference[np.isfinite(reference)]
    mean = float(np.mean(finite, dtype=np.float64)) if finite.size else 0.0
    if mean <= 0:
        return 0.0
    return min(max(round(4 * math.log2(MIDDLE_GREY / mean)) / 4, -12.0), 12.0)


def first_error_scale(first: NDArray[np.float32], second: NDArray[np.float32]) -> float:
    """Power of ten, a multiple of a quarter from -7 to 1, of the largest difference."""
    with np.errstate(invalid="ignore"):
        difference = np.abs(first.astype(np.float64) - second)
    largest = float(np.max(difference[np.isfinite(difference)], initial=0.0))
    if largest <= 0:
        return -2.0
    return min(max(math.ceil(4 * math.log10(largest)) / 4, -7.0), 1.0)


def timing_notes(comparison: Comparison) -> list[str]:
    notes = [
        f"A frame is the median of {len(comparison.mlrt.timings.frames)}, which both "
        "render in turns; each row has a scale of its own."
    ]
    cached = comparison.mitsuba.timings.kernels_from_disk
    if cached:
        notes.append(
            f"The JIT time is short: {cached} kernels of earlier runs came from Dr.Jit's "
            "cache."
        )
    return notes


def difference_rows(figures: dict[str, Any]) -> list[tuple[str, str]]:
    found = figures["difference"]
    if found is None:
        return []
    return [
        ("largest", number(found["max_abs"])),
        ("RMSE", number(found["rmse"])),
        ("relMSE", number(found["rel_mse"])),
        ("pixels that differ", f"{found['differing']} of {found['pixels']}"),
        ("pixels not finite", str(found["nonfinite"])),
    ]


def setting_rows(comparison: Comparison) -> list[tuple[str, str]]:
    settings = comparison.settings
    height, width = comparison.mlrt.image.shape[:2]
    return [
        ("scene", str(settings.scene)),
        ("film", f"{width} x {height}"),
        ("samples a pixel", str(comparison.spp)),
        ("seed", str(settings.seed)),
        ("sensor", str(settings.sensor)),
        ("threads", str(comparison.threads)),
        ("shaded by", comparison.shading),
        *((f"${key}", str(value)) for key, value in settings.defines.items()),
        *(("warning", warning) for warning in comparison.warnings),
    ]


def machine_rows(machine: dict[str, Any]) -> list[tuple[str, str]]:
    rows = []
    for key, value in machine.items():
        if value is None:
            continue
        if key == "load":
            value = ", ".join(f"{load:.2f}" for load in value)
        elif key == "memory_bytes":
            key, value = "memory", f"{value / 2**30:.1f} GiB"
        rows.append((key.replace("_", " "), str(value)))
    return rows


def verdict_text(figures: dict[str, Any]) -> str:
    """The verdict, and where it is favourable what it is of."""
    if not figures["passed"]:
        return str(figures["verdict"])
    found = figures["difference"]
    return (
        f"{figures['verdict']}: {found['differing']:,} of {found['pixels']:,} pixels "
        f"differ by more than {RELATIVE_TOLERANCE:g} of the larger value; "
        f"{100 * MAXIMUM_SHARE:g} % may"
    )


def plot_of(speed_error: dict[str, Any] | None) -> dict[str, Any]:
    """The plot of speed against error as SVG in base64, and what has to be said of it."""
    if speed_error is None:
        return {"plot": None, "plot_notes": ""}
    from .speed_error_text import over_all, plot

    notes = (
        f"{speed_error['width']} x {speed_error['height']} pixels, "
        f"{plural(speed_error['threads'])}. MLRT, over all: "
        f"{'; '.join(over_all(speed_error))}; intervals of 95 %, measured "
        f"{speed_error['machine']['time']}."
    )
    if not speed_error["passed"]:
        notes += " Not to be called a speed-up: " + "; ".join(speed_error["reasons"]) + "."
    if speed_error["disturbed"]:
        notes += " Times of the same differ by more than 10 %: not to be published."
    return {
        "plot": base64.b64encode(plot(speed_error, "svg")).decode(),
        "plot_notes": notes,
    }


def number(value: float | None) -> str:
    return "not finite" if value is None else f"{value:.4g}"
