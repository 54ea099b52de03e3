"""One comparison of two EXR files."""

from __future__ import annotations

import argparse
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .exr_files import (
    ExrImage,
    check_comparable,
    check_finite_reference,
    colour_of,
    common_channels,
    read_exr,
)
from .image_figures import ImageFigures, image_figures
from .limits import IDIFF_THRESHOLD, ImageVerdict, Limits, judge_figures
from .metric_names import METRICS
from .options import CannotRun
from .ztest import ZTest, z_test


@dataclass(frozen=True)
class ImagePair:
    """Two images, how they differ, and what that means."""

    image: ExrImage
    reference: ExrImage
    names: tuple[str, ...]
    figures: ImageFigures
    z_test: ZTest | None
    verdict: ImageVerdict

    def as_dict(self) -> dict[str, Any]:
        """All figures; JSON has None for those that are not finite."""
        width, height = self.image.size
        return {
            "image": str(self.image.path),
            "reference": str(self.reference.path),
            "width": width,
            "height": height,
            **self.figures.as_dict(),
            "z_test": None if self.z_test is None else self.z_test.as_dict(),
            "verdict": self.verdict.word,
            "failures": list(self.verdict.failures),
            "warnings": list(self.verdict.warnings),
        }

    def text(self) -> str:
        """The figures as lines."""
        width, height = self.image.size
        lines = [
            f"{self.image.path} against {self.reference.path}: {width} x {height}, "
            f"channels {', '.join(self.names)}"
        ]
        for channel in self.figures.channels:
            broken = channel.nan + channel.infinite
            lines.append(
                f"  {channel.name:<10} max {shown(channel.max_abs)}  RMSE "
                f"{shown(channel.rmse)}  mean {shown(channel.mean_image)} against "
                f"{shown(channel.mean_reference)}"
                + (f"  {channel.nan} nan, {channel.infinite} infinite" if broken else "")
            )
        if self.figures.colour:
            metrics = self.figures.metrics
            lines.append("  ".join(f"{name} {shown(metrics[name])}" for name in METRICS))
        else:
            lines.append("no colour (R, G and B, or Y): no metrics of it")
        lines.append(
            "pixels beyond "
            + "  ".join(
                f"{share['threshold']:g}: {100 * share['share']:.4g} %"
                for share in self.figures.as_dict()["beyond"]
            )
        )
        if self.z_test is not None:
            lines.append(
                f"z-test: {100 * self.z_test.passing:.4f} % pass, smallest p "
                f"{self.z_test.smallest_p:.3g}, of the mean {self.z_test.mean_p:.3g}"
            )
        lines.append(str(self.verdict))
        return "\n".join(lines)


def compare_pair(
    image_path: Path, reference_path: Path, options: argparse.Namespace
) -> ImagePair:
    """Compares two files as the options of the command say. Raises CannotRun."""
    image, reference = read_exr(image_path), read_exr(reference_path)
    check_comparable(image, reference)
    names = common_channels(image, reference, options.channels)
    check_finite_reference(reference, names)
    figures = image_figures(image, reference, names)
    test = None
    if options.variance is not None:
        test = tested(image, reference, read_exr(options.variance), names, options)
    usual = (
        math.inf
        if options.fail_if or options.warn_if or test is not None
        else IDIFF_THRESHOLD
    )
    failing = Limits(
        usual if options.fail is None else options.fail,
        options.failpercent,
        options.hardfail,
        dict(options.fail_if),
    )
    warning = Limits(
        usual if options.warn is None else options.warn,
        options.warnpercent,
        options.hardwarn,
        dict(options.warn_if),
    )
    reasons = [] if test is None else test.reasons()
    verdict = judge_figures(figures, failing, warning, reasons)
    return ImagePair(image, reference, names, figures, test, verdict)


def tested(
    image: ExrImage,
    reference: ExrImage,
    variance: ExrImage,
    names: tuple[str, ...],
    options: argparse.Namespace,
) -> ZTest:
    """The z-test of the colour channels, in the colour space of the files."""
    colour = colour_of(names)
    if not colour:
        raise CannotRun(f"{image.path} has no colour to test: R, G and B, or Y")
    check_comparable(variance, reference)
    common_channels(variance, reference, colour)
    check_finite_reference(variance, colour)
    return z_test(
        image.stack(colour),
        reference.stack(colour),
        variance.stack(colour),
        options.spp,
        reference_spp=options.reference_spp or math.inf,
    )


def shown(value: float | None) -> str:
    if value is None:
        return "-"
    return "not finite" if math.isnan(value) else f"{value:.4g}"
