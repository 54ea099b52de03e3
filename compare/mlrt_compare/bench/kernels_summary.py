"""Speed against accuracy at one glance: the table of `mlrt-bench kernels`."""

from __future__ import annotations

from typing import Any

from .kernels import KERNELS, USUAL
from .markdown import table

Row = dict[str, Any]
FAST, DOUBLE, EXACT = (KERNELS[name] for name in ("single", "double", "exact"))
ROWS = (
    ("fast", FAST, "mitsuba"),
    ("double", DOUBLE, "mitsuba"),
    ("watertight", EXACT, "mitsuba"),
    ("watertight + robust offset", EXACT, "robust"),
    (f"{USUAL} + robust offset", USUAL, "robust"),
    ("Embree default", "Embree default", "mitsuba"),
    ("Embree robust", "Embree robust", "mitsuba"),
)
"""A name, the contender, and the offset of its shadow rays."""


def summary(figures: dict[str, Any]) -> list[Row]:
    """A row for each of ROWS, of the first number of threads.

    rays_per_second: of rays through pixels of the first mesh. wrong_per_billion (leaks
    too), far_per_billion of these, leaks, rays, ulps_max: over all meshes and aims.
    shadow_rays_per_second, acne_pixels (of lit_pixels), leak_pixels (of dark_pixels): of
    the shadow rays of all sizes.
    """
    threads = figures["settings"]["threads"][0]
    blocks = [
        block
        for scene in figures["scenes"]
        for block in scene["blocks"]
        if block["threads"] == threads
    ]
    shadows = [block for block in figures["shadows"] if block["threads"] == threads]
    pixels = next(block for block in blocks if block["aim"] == "pixels")
    rows = []
    for name, contender, offset in ROWS:
        hits = [
            row for block in blocks for row in block["rows"] if row["name"] == contender
        ]
        rays = sum(row["rays"] for row in hits)
        far = sum(row["leaks"] + row["far_off"] for row in hits)
        wrong = sum(row["leaks"] + row["wrong_hits"] for row in hits)
        shaded = [
            row
            for block in shadows
            for row in block["rows"]
            if (row["name"], row["offset"]) == (contender, offset)
        ]
        of_pixels = next(row for row in pixels["rows"] if row["name"] == contender)
        rows.append(
            {
                "name": name,
                "rays_per_second": of_pixels["rays_per_second"],
                "wrong_per_billion": 1e9 * wrong / rays,
                "far_per_billion": 1e9 * far / rays,
                "ulps_max": max(row["ulps_max"] for row in hits),
                "leaks": sum(row["leaks"] for row in hits),
                "rays": rays,
                "shadow_rays_per_second": shaded[0]["rays_per_second"],
                "acne_pixels": sum(row["acne"] for row in shaded),
                "lit_pixels": sum(row["lit"] for row in shaded),
                "leak_pixels": sum(row["leaks"] for row in shaded),
                "dark_pixels": sum(row["dark"] for row in shaded),
            }
        )
    return rows


def summary_lines(figures: dict[str, Any]) -> list[str]:
    """Markdown."""
    head = (
        *("", "Mrays/s, pixels", "Mrays/s, shadows", "wrong hits of 10^9", "far off"),
        *("t error, ulps", "leaking rays", "acne pixels", "leaking pixels"),
    )
    rows = [
        (
            row["name"],
            f"{row['rays_per_second'] / 1e6:.2f}",
            f"{row['shadow_rays_per_second'] / 1e6:.2f}",
            f"{row['wrong_per_billion']:,.0f}",
            f"{row['far_per_billion']:,.0f}",
            f"{row['ulps_max']:,}",
            f"{row['leaks']:,} of {row['rays']:,}",
            f"{row['acne_pixels']:,} of {row['lit_pixels']:,}",
            f"{row['leak_pixels']:,} of {row['dark_pixels']:,}",
        )
        for row in summary(figures)
    ]
    return table(head, rows)
