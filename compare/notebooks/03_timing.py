# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Timing comparison
#
# How long do both take for the same image? A time is a statement about a machine at a
# moment, so this notebook keeps to a few rules:
#
# * the frames of both come in turns, A B B A, so that a machine that slows down weighs on
#   both alike;
# * medians are told, not best cases, and the ratio has an interval;
# * the same renderer is held against itself: what differs there is noise;
# * loading, building, and compiling stand apart from steady frames;
# * the machine and its load are written down.
#
# `MLRT_NOTEBOOKS=small` in the environment chooses settings that take a few seconds and are
# too small to say anything about speed.

# %%
import os
from pathlib import Path

import mlrt_plugin  # before Mitsuba: it tells Dr.Jit which libLLVM to take

SMALL = os.environ.get("MLRT_NOTEBOOKS") == "small"
SCENE = Path("../../scenes/office/office.xml")
RESOLUTION = (128, 128) if SMALL else (512, 512)
SPP = 4 if SMALL else 16
ROUNDS = 4 if SMALL else 16  # of four frames each

mlrt_plugin.__version__

# %%
from mlrt_compare.machine import machine_of_comparison
from mlrt_compare.run import compare
from mlrt_compare.settings import Settings

machine = machine_of_comparison()  # with the load before anything is measured
settings = Settings(SCENE, spp=SPP, resolution=RESOLUTION)
comparison = compare(settings, rounds=ROUNDS)
sides = (comparison.mlrt, comparison.mitsuba)
print(f"{comparison.threads} threads; images: {comparison.verdict}")

# %% [markdown]
# Every steady frame in the order in which it was measured. The two bands should be flat and
# narrow. A slope is a machine that gets hotter or busier; single high points are
# other processes. If the bands are as wide as their distance, the comparison says nothing.
# On the right, MLRT is loaded first, and so pays alone for what both need only once.

# %%
import matplotlib.pyplot as plt
from mlrt_compare.error_plot import COLOURS

figure, (frames, cold) = plt.subplots(
    1, 2, figsize=(12, 4.2), layout="constrained", width_ratios=(3, 2)
)
for side, colour in zip(sides, COLOURS, strict=True):
    times = [1000 * seconds for seconds in side.timings.frames]
    frames.plot(times, "o", color=colour, markersize=4, label=side.name)
    frames.axhline(1000 * side.timings.steady, color=colour, linewidth=1)
frames.set(xlabel="frame", ylabel="milliseconds", ylim=(0, None))
frames.set_title("Steady frames, in order; lines are medians", loc="left")
figure.legend(loc="outside lower center", ncols=2)

parts = ("load", "build", "first", "steady")
for number, (side, colour) in enumerate(zip(sides, COLOURS, strict=True)):
    heights = [getattr(side.timings, part) or 0 for part in parts]
    places = [index + 0.38 * number for index in range(len(parts))]
    bars = cold.bar(places, heights, 0.36, color=colour)
    cold.bar_label(bars, fmt="%.2g", fontsize=8)
cold.set_xticks([index + 0.19 for index in range(len(parts))], parts)
cold.set(yscale="log", ylabel="seconds, logarithmic")
cold.margins(y=0.15)
cold.set_title("From the scene file to a steady frame", loc="left")
plt.show()

# %% [markdown]
# The ratio of the medians, with an interval of 95 % by a bootstrap over the frames. **A
# against A** is the median of every other frame of one renderer over that of the rest: as
# far as that is from 1, a ratio cannot be told from chance. Times that spread by more than
# 10 %, or of a machine that others used at the start, are not to be published, whatever
# the ratio is: other processes may weigh on one renderer more than on the other.

# %%
import numpy as np
from IPython.display import Markdown
from mlrt_compare.error_curves import Runs
from mlrt_compare.speed_error import halves, spread
from mlrt_compare.speed_error_figures import PUBLISHABLE_SPREAD

seconds = np.array([[side.timings.frames] for side in sides])
ratio = Runs((comparison.spp,), seconds, np.ones_like(seconds)).equal_samples_time(0)
rows = [
    "| | load, s | build, s | first frame, s | steady, s | spread | A against A |",
    "|---|---|---|---|---|---|---|",
]
for side in sides:
    t = side.timings
    build = "not told" if t.build is None else f"{t.build:.4f}"
    rows.append(
        f"| {side.name} | {t.load:.3f} | {build} | {t.first:.4f} | {t.steady:.4f} "
        f"| {100 * spread(t.frames):.1f} % | {100 * halves(t.frames):.1f} % |"
    )
doubts = [
    f"the times of {side.name} spread by more than 10 %"
    for side in sides
    if max(spread(side.timings.frames), halves(side.timings.frames)) > PUBLISHABLE_SPREAD
]
if machine["load"][0] > 0.5:
    doubts.append(f"the machine had a load of {machine['load'][0]:.1f} at the start")
rows += [
    "",
    f"Mitsuba's steady frame takes **{ratio.value:.2f}** times as long as MLRT's "
    f"({ratio.low:.2f} to {ratio.high:.2f}).",
    "",
    f"**These times are not to be published:** {'; '.join(doubts)}."
    if doubts
    else "The machine was quiet, and the times of the same agree.",
]
Markdown("\n".join(rows))

# %% [markdown]
# What the times depend on. Mitsuba's *first* frame holds the tracing and compiling of its
# kernels, unless an earlier run left them in Dr.Jit's cache (`kernels from disk`): then it
# looks better than a user's first frame would be. The `load` is that of the system
# over the last 1, 5 and 15 minutes before the measurement.

# %%
mitsuba_times = comparison.mitsuba.timings
record = {
    **machine,
    "kernels compiled": mitsuba_times.kernels_compiled,
    "kernels from disk": mitsuba_times.kernels_from_disk,
}
for name, value in record.items():
    print(f"{name:<18}{value}")

# %% [markdown]
# **What this does not say.** One scene, one size, one machine. Both sides take the
# estimator of `direct` with one emitter sample; where Mitsuba's BSDF samples would help it,
# an equal number of samples is not an equal error. Notebook 4 asks for the error too.
