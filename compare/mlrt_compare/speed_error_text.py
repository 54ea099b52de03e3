"""Speed against error as Markdown and as a plot."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

from matplotlib.figure import Figure

from .error_plot import draw_error_curves, scene_name


def markdown(figures: dict[str, Any]) -> str:
    """The figures as a page, the machine and all that speaks against them included."""
    sides, machine = figures["sides"], figures["machine"]
    lines = [
        f"# Speed against error: {figures['scene']}",
        "",
        f"{figures['width']} x {figures['height']} pixels, {figures['threads']} threads, "
        f"{figures['rounds']} rounds; {machine['processor']}, {machine['cores']} cores, "
        f"load {machine['load'][0]:.1f}, {machine['time']}; MLRT {machine['mlrt']} at "
        f"{(machine['commit'] or 'no commit')[:10]} ({machine['isa']}), Mitsuba "
        f"{machine['mitsuba']}.",
        "",
    ]
    if figures["disturbed"]:
        lines += [
            "**Times not to be published:** runs of the same differ by more than 10 % for "
            + ", ".join(figures["disturbed"])
            + ".",
            "",
        ]
    lines += [
        "**"
        + ("PASS" if figures["passed"] else "FAIL: " + "; ".join(figures["reasons"]))
        + "**",
        "",
        "Factors are Mitsuba's over MLRT's, above 1 where MLRT is better, with intervals "
        "of 95 %. " + frames_in_a_row(figures),
        "",
        "| spp | s MLRT | s Mitsuba | MSE MLRT | MSE Mitsuba | time, equal samples "
        "| MSE, equal samples | MSE, equal time | time, equal error |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for index, sample in enumerate(figures["samples"]):
        points = [side["points"][index] for side in sides]
        cells = [
            str(sample["spp"]),
            *(f"{point['median']:.4g}" for point in points),
            *(f"{point['mse']:.3e}" for point in points),
            *(
                estimate(sample[key])
                for key in (
                    "time_at_equal_samples",
                    "mse_at_equal_samples",
                    "equal_time",
                    "equal_error",
                )
            ),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        "Over all: " + "; ".join(over_all(figures)) + ".",
        "",
        "| | load | build | first frame | JIT | slope of MSE |",
        "|---|---|---|---|---|---|",
    ]
    for side in sides:
        point = side["points"][0]
        lines.append(
            f"| {side['name']} | {seconds(side['load'])} | {seconds(side['build'])} "
            f"| {seconds(point['first'])} | {seconds(point['jit'])} "
            f"| {estimate(side['slope'], 3)} |"
        )
    if figures["kernels_from_disk"]:
        lines += [
            "",
            f"Mitsuba's first frame is short: {figures['kernels_from_disk']} kernels of "
            "earlier runs came from Dr.Jit's cache.",
        ]
    reference, bias = figures["reference"], figures["bias"]
    low, high = bias["relative_interval_99"]
    lines += [
        "",
        f"Errors are against Mitsuba's mean of {reference['spp']} samples a pixel, whose "
        f"own MSE of {reference['mse_of_mitsubas']:.2e} is taken off. MLRT's mean of as "
        f"many has {reference['mse_of_mlrts']:.2e}; between the two remain "
        f"{reference['mse_between']:.2e}. Bias by Welch's t-test: {bias['tiles']} tiles, "
        f"smallest p {bias['smallest_p']:.2g} for all together, uniform with p "
        f"{bias['uniform_p']:.2g}, means with p {bias['mean_p']:.2g}; MLRT's mean is "
        f"{100 * low:+.4f} % to {100 * high:+.4f} % from Mitsuba's (99 %). The noise of "
        f"the tiles has the same variance with p {bias['spread_smallest_p']:.2g}; over "
        f"all, MLRT's is {bias['variance_ratio']:.3f} times Mitsuba's. {quiet_tiles(bias)}",
    ]
    if figures["disputed_tiles"] is not None:
        lines += ["", disputed_tiles(figures["bias"], figures["disputed_tiles"])]
    even = figures["break_even_frames"]
    lines += [
        "",
        "What MLRT needs more to load and build is "
        + ("not won back." if even is None else f"won back after {even:.2g} frames."),
        "",
    ]
    return "\n".join(lines)


def over_all(figures: dict[str, Any]) -> Iterator[str]:
    """Both factors, a phrase each, or that the curves do not tell them."""
    count = len(figures["samples"])
    for kind, less in (("time", "MSE"), ("error", "time")):
        factor = figures[f"equal_{kind}"]
        if factor["value"] is None:
            yield f"the curves do not overlap at equal {kind}"
            continue
        yield (
            f"at equal {kind} {estimate(factor)} times less {less} (geometric mean over "
            f"{len(figures[f'equal_{kind}_spp'])} of {count} numbers of samples, where the "
            "curves overlap)"
        )


def frames_in_a_row(figures: dict[str, Any]) -> str:
    """What a time is of; both sides have the same numbers of frames."""
    points = figures["sides"][0]["points"]
    counts = ", ".join(f"{point['frames']} at {point['spp']} spp" for point in points)
    return (
        "A time is the mean of frames in a row that take "
        f"{1e3 * figures['least_seconds']:g} ms or "
        f"more together ({counts}), the error that of the last of them."
    )


def quiet_tiles(bias: dict[str, Any]) -> str:
    """What became of the tiles that Welch's test leaves out."""
    count, differing = bias["quiet_tiles"], bias["differing_quiet"]
    if not count:
        return "All tiles have more noise than rounding."
    differ = {0: "none of them differs", 1: "1 of them differs"}
    return (
        f"{count} tiles have less noise than rounding; "
        f"{differ.get(differing, f'{differing} of them differ')} by more than both explain "
        f"(smallest p {bias['quiet_smallest_p']:.2g} for all together)."
    )


def disputed_tiles(bias: dict[str, Any], disputed: dict[str, Any]) -> str:
    """What failed among all tiles, and what remains without those of disputed rays."""
    judged, others = disputed["judgement"], disputed["others"]
    told = "none are left" if others is None else "the others pass"
    if others is not None and not others["passed"]:
        told = "of the others " + "; ".join(others["reasons"])
    return (
        f"Of all tiles: {'; '.join(bias['reasons'])}. With the same {disputed['spp']} "
        f"samples a pixel, {judged['rays']} of {disputed['rays']} rays hit something else "
        f"in Mitsuba; by exact arithmetic both are right in {judged['both_right']} (faces "
        f"equally near, or rays that differ by rounding), only MLRT in "
        f"{judged['only_ours']}, only Mitsuba in {judged['only_theirs']}, neither in "
        f"{judged['both_wrong']}; {judged['not_judged']} are not judged. All other pixels "
        f"differ by {disputed['rmse']:.1e} of the mean (RMS). Without the "
        f"{disputed['tiles']} tiles of such rays, {told}."
    )


def estimate(value: dict[str, Any], digits: int = 2) -> str:
    if value["value"] is None:
        return "-"
    if value["low"] is None:
        return f"{value['value']:.{digits}f}"
    return (
        f"{value['value']:.{digits}f} ({value['low']:.{digits}f} to "
        f"{value['high']:.{digits}f})"
    )


def seconds(value: float | None) -> str:
    return "-" if value is None else f"{value:.4g} s"


def plot(figures: dict[str, Any], kind: str) -> bytes:
    """MSE over the time of a frame of both renderers; ``kind`` is png or svg."""
    figure = Figure(figsize=(7, 4.6), layout="constrained")
    axes = figure.add_subplot()
    draw_error_curves(axes, figures["sides"], label_size=8)
    axes.set_xlabel("milliseconds a frame (median and quartiles)")
    axes.set_ylabel("MSE against the reference")
    axes.set_title(
        f"{scene_name(figures['scene'])}: numbers are samples a pixel", fontsize=10
    )
    figure.legend(loc="outside upper center", ncols=2)
    stream = io.BytesIO()
    figure.savefig(stream, format=kind, dpi=150)
    return stream.getvalue()
