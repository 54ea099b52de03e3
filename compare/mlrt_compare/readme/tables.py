"""The tables of README.md, as Markdown, from the figures that the commands keep."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ..bench.markdown import table
from ..bench.measure import best
from ..bench.rays_table import work
from ..bench.speedup import frame_seconds
from ..bench.table import number, plural
from ..error_plot import scene_name

Figures = Sequence[dict[str, Any]]


def ratio(value: float) -> str:
    """A ratio of times, in bold where MLRT is slower."""
    text = f"{value:.2f}"
    return f"**{text}**" if value < 1 else text


def best_and_median(speedup: dict[str, Any]) -> str:
    return f"{ratio(speedup['best'])} ({ratio(speedup['median'])})"


def machine_of(figures: dict[str, Any]) -> str:
    """The processor with its instruction set, the day, and the commit."""
    machine = figures["machine"]
    return (
        f"{isa_of(figures)} on {machine['processor']}, {machine['time'][:10]}, "
        f"{(machine['commit'] or 'no commit')[:10]}"
    )


def isa_of(figures: dict[str, Any]) -> str:
    isa = str(figures["machine"]["isa"])
    return {"avx2": "AVX2", "avx512": "AVX-512"}.get(isa, isa)


def machines_of(all_figures: Figures) -> str:
    return "; ".join(dict.fromkeys(map(machine_of, all_figures)))


def pixels_of(figures: Figures) -> str:
    sides = dict.fromkeys(each["settings"]["resolution"] for each in figures)
    return " or ".join(f"{side} x {side}" for side in sides)


def blocks_of(figures: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for scene in figures["scenes"]:
        for block in scene.get("blocks", ()):
            yield scene["name"], block


def ray_lines(all_figures: Figures) -> list[str]:
    """`mlrt-bench rays`: a row a scene and kind of rays, two columns for each instruction
    set and number of threads."""
    columns: dict[str, None] = {}
    cells: dict[tuple[str, str], dict[str, dict[str, Any]]] = {}
    for figures in all_figures:
        for scene, block in blocks_of(figures):
            both = " for both" if figures["settings"].get("same_isa") else ""
            column = f"{isa_of(figures)}{both}, {plural(block['threads'])}"
            columns[column] = None
            row = cells.setdefault((scene, work(block["spp"], block["shadows"])), {})
            row[column] = block
    head = ["scene", "rays"]
    for column in columns:
        head += [column, "Mrays/s"]
    rows = []
    for (scene, rays), row in cells.items():
        line = [scene, rays]
        for column in columns:
            found = row.get(column)
            line += ["-", "-"] if found is None else [*ray_cells(found)]
        rows.append(line)
    blocks = [block for figures in all_figures for _, block in blocks_of(figures)]
    limits = [
        "Where an instruction set is *for both*, Embree is limited to it (`--same-isa`)."
        for figures in all_figures
        if figures["settings"].get("same_isa")
    ][:1]
    return [
        f"`mlrt-bench rays`: {pixels_of(all_figures)} pixels; the same rays by MLRT and by "
        "Embree 3 of the mitsuba wheel in whichever of its modes and build qualities is "
        "the fastest in the run, each with the best of its tiles "
        f"({tiles_of(all_figures)}). "
        f"{disagreement(blocks)} MLRT knows the camera and bounds beams by its film. "
        f"Mrays/s are MLRT's. {machines_of(all_figures)}.",
        "",
        *table(head, rows),
        "",
        " ".join(
            [
                *limits,
                "Embree has packets of 16 rays with AVX-512 and not without; MLRT tests 8 "
                "triangles at a time, and with AVX-512 16 where a beam meets many.",
            ]
        ),
    ]


def ray_cells(block: dict[str, Any]) -> tuple[str, str]:
    own = next(each for each in block["contenders"] if each["engine"] == "MLRT")
    seconds = best(frame_seconds(own, "wall"))
    rays = sum(block["rays"].values())
    return best_and_median(block["speedup"]), number(1e-6 * rays / seconds)


def tiles_of(all_figures: Figures) -> str:
    """The sides of tiles that were tried, and how often each mode was run."""
    tried = dict.fromkeys(
        f"{' or '.join(map(str, each['settings']['tiles']))} rays a side, "
        f"{each['settings']['repeats']} runs"
        for each in all_figures
    )
    return "; ".join(tried)


def disagreement(blocks: Figures) -> str:
    """In how many rays engines differ in hit or miss, at most."""
    shares = [
        contender["differing"]["hit"] / block["rays"]["primary"]
        for block in blocks
        for contender in block["contenders"]
    ]
    return (
        f"They differ in hit or miss for at most {1e6 * max(shares, default=0.0):.2g} of a "
        "million camera rays."
    )


def frame_lines(all_figures: Figures) -> list[str]:
    """`mlrt-bench frames`: a row a scene, number of samples and of threads."""
    rows = []
    for figures in all_figures:
        for scene, block in blocks_of(figures):
            own, peer = (
                best(frame_seconds(contender, "wall")) for contender in block["contenders"]
            )
            agree = "pass" if block["verdict"]["passed"] else "**FAIL**"
            rows.append(
                [
                    scene,
                    f"{isa_of(figures)}, {plural(block['threads'])}",
                    str(block["spp"]),
                    *(number(1e3 * seconds) for seconds in (own, peer)),
                    best_and_median(block["speedup"]),
                    agree,
                ]
            )
    return [
        f"`mlrt-bench frames`: {pixels_of(all_figures)} pixels, from the loaded and built "
        "scene to the finished film, beside `direct` of Mitsuba's `llvm_ad_rgb`. "
        f"{machines_of(all_figures)}.",
        "",
        *table(("scene", "", "spp", "MLRT ms", "Mitsuba ms", "ratio", "images"), rows),
    ]


def speed_error_lines(all_figures: Figures) -> list[str]:
    """`mlrt-compare speed-error`: factors over all numbers of samples, and cold starts."""
    warm, cold, failed = [], [], []
    for figures in all_figures:
        name = scene_name(figures["scene"])
        ours, theirs = figures["sides"]
        spp = [point["spp"] for point in ours["points"]]
        warm.append(
            [
                name,
                f"{figures['width']} x {figures['height']}",
                f"{spp[0]} to {spp[-1]}",
                interval(figures["equal_time"]),
                interval(figures["equal_error"]),
                *(interval(side["slope"]) for side in (ours, theirs)),
                "**FAIL**" if not figures["passed"] else "pass",
            ]
        )
        starts = [cold_start(side) for side in (ours, theirs)]
        cold.append([name, *starts[0], *starts[1], break_even(figures)])
        failed += [f"{name}: {reason}" for reason in figures["reasons"]]
        if figures["disturbed"]:
            which = ", ".join(figures["disturbed"])
            failed.append(f"{name}: times that are not to be published, of {which}")
    threads = dict.fromkeys(plural(figures["threads"]) for figures in all_figures)
    lines = [
        "`mlrt-compare speed-error`: how many times less MSE MLRT has at equal time, and "
        "how many times less time it needs at equal error, frames warm, with intervals of "
        "95 %. *pass* says that both are the same estimator: the MSE falls with samples "
        "to the power of -1 and no bias shows. "
        f"{' or '.join(threads)}; {machines_of(all_figures)}.",
        "",
        *table(
            (
                *("scene", "pixels", "spp", "MSE, equal time", "time, equal error"),
                *("slope MLRT", "slope Mitsuba", "verdict"),
            ),
            warm,
        ),
        "",
        "Cold, in seconds; a first frame of Mitsuba's includes what its compiler takes:",
        "",
        *table(
            (
                *("scene", "MLRT: load", "build", "first frame"),
                *("Mitsuba: load", "build", "first frame", "frames to win it back"),
            ),
            cold,
        ),
    ]
    return [*lines, "", *(f"- {line}" for line in failed)] if failed else lines


def interval(value: dict[str, Any]) -> str:
    if value["value"] is None:
        return "-"
    text = ratio(value["value"]) if value["value"] > 0 else f"{value['value']:.3f}"
    if value["low"] is None:
        return text
    digits = 2 if value["value"] > 0 else 3
    return f"{text} ({value['low']:.{digits}f} to {value['high']:.{digits}f})"


def cold_start(side: dict[str, Any]) -> list[str]:
    return [number(s) for s in (side["load"], side["build"], side["points"][0]["first"])]


def break_even(figures: dict[str, Any]) -> str:
    frames = figures["break_even_frames"]
    return "never" if frames is None else number(frames)


def order_lines(all_figures: Figures) -> list[str]:
    """`mlrt-bench order`: a row a scene and order."""
    rows = []
    for figures in all_figures:
        for scene, block in blocks_of(figures):
            for row in block["rows"]:
                own, peer = (row["nanoseconds"][key] for key in ("MLRT", "Embree"))
                rows.append(
                    [
                        scene,
                        plural(block["threads"]),
                        row["order"],
                        number(own),
                        number(peer),
                        ratio(peer / own),
                    ]
                )
    return [
        "`mlrt-bench order`: nanoseconds a ray of arrays that `closest_hit` is given, by "
        "MLRT and by Embree in whichever is the fastest for them: packets of 16, told to "
        "be coherent or not, or streams of single rays, at either build quality; "
        f"{pixels_of(all_figures)} rays. {machines_of(all_figures)}.",
        "",
        *table(("scene", "", "rays", "MLRT ns", "Embree ns", "ratio"), rows),
    ]


def paper_lines(all_figures: Figures) -> list[str]:
    """`mlrt-compare paper`: tables 1 to 3 in short."""
    # What is measured with Mitsuba is not needed for the tables of the paper.
    from ..paper.published import PUBLISHED
    from ..paper.sections import rate
    from ..paper.study import measured
    from ..paper.ways import ADAPTIVE, PAPER, WITHOUT

    scenes = [scene for figures in all_figures for scene in measured(figures)]
    counts, rates = [], []
    for scene in scenes:
        published = PUBLISHED.get(scene["name"])
        ways = scene["counts"]["ways"]
        line = [scene["name"], f"{scene['triangles']:,}"]
        for kind in ("primary", "primary_and_shadow"):
            own, root = (ways[way.key][kind]["steps"] for way in (PAPER, WITHOUT))
            line += [f"{root:.1f}", f"{own:.1f}", f"{root / own:.2f}"]
            if published is None:
                line.append("-")
            else:
                theirs = published.primary if kind == "primary" else published.with_shadows
                line.append(f"{theirs.reduction:.2f}")
        counts.append(line)
        for block in scene["rates"]:
            found = [block["ways"][way.key] for way in (WITHOUT, PAPER, ADAPTIVE)]
            rays = "primary and shadow" if block["shadows"] else "primary"
            rows = [scene["name"], plural(block["threads"]), rays]
            rates.append([*rows, *map(rate, found), gain(found[1], found[2])])
    pages = ", ".join(
        f"[{name}](compare/results/{name}/paper.md)"
        for name in dict.fromkeys(each["folder"] for each in all_figures)
    )
    return [
        f"`mlrt-compare paper`, whole in {pages}: steps through the tree for 16 rays "
        "without and with entry points, and how many times fewer, beside the ratio of the "
        f"paper. {machines_of(all_figures)}.",
        "",
        *table(
            (
                *("scene", "triangles", "primary: without", "with", "ratio", "paper"),
                *("and shadow: without", "with", "ratio", "paper"),
            ),
            counts,
        ),
        "",
        "Frames a second of the paper's packets without and with entry points, and of the "
        "beams that this project traces by default, with the ratio of the last two; a star "
        "marks rates that others disturbed:",
        "",
        *table(("scene", "", "rays", "without", "with", "beams", "ratio"), rates),
    ]


def gain(before: dict[str, Any], after: dict[str, Any]) -> str:
    """Of rates; what was too slow to be timed has none."""
    return "-" if before["rate"] is None else ratio(after["rate"] / before["rate"])


def leak_lines(all_figures: Figures) -> list[str]:
    """`mlrt-bench watertight`: rays that find nothing, of all meshes together."""
    rows = []
    for figures in all_figures:
        total = figures["total"]
        for name, leaks in total["leaks"].items():
            # Others than MLRT trace a part of the rays.
            rays = total.get("traced", {}).get(name, total["rays"])
            share = f"{100 * leaks / rays:.2g} %" if leaks else "0"
            rows.append([name, f"{rays:,}", f"{leaks:,}", share])
    return [
        "`mlrt-bench watertight`: rays from inside of closed meshes at vertices and edges "
        "that find nothing; [wrong-hits.md](compare/results/wrong-hits.md) has each mesh, "
        "and other wrong hits.",
        "",
        *table(("", "rays", "leaks", "share"), rows),
    ]


def kernel_lines(all_figures: Figures) -> list[str]:
    """`mlrt-bench kernels`: what exact tests cost and give, beside Embree."""
    names = ("MLRT as usual", "Embree default", "Embree robust")
    rows = []
    for figures in all_figures:
        for mesh, block in blocks_of(figures):
            found = {row["name"]: row for row in block["rows"]}
            own, default, robust = (found[name] for name in names)
            rates = [row["rays_per_second"] for row in (own, default, robust)]
            leaks = [1e6 * row["leaks"] / row["rays"] for row in (default, robust)]
            rows.append(
                [
                    mesh,
                    block["aim"],
                    plural(block["threads"]),
                    *(number(1e-6 * rate) for rate in rates),
                    ratio(rates[0] / rates[1]),
                    *(f"{share:,.0f}" for share in leaks),
                ]
            )
    return [
        "`mlrt-bench kernels`: Mrays/s of rays from inside of closed meshes, most of which "
        "have little in common, as MLRT traces by default and by Embree in packets of 16, "
        "and leaks of a million rays. MLRT has none. "
        f"{machines_of(all_figures)}.",
        "",
        *table(
            (
                *("mesh", "rays at", "", "MLRT", "Embree default", "robust"),
                *("ratio to default", "leaks: default", "robust"),
            ),
            rows,
        ),
    ]
