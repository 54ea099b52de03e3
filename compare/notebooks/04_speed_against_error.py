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
# # Speed against error
#
# A renderer that is fast but noisy is not fast. What counts is the error that is reached in
# a time. This notebook measures both over numbers of samples, against a reference that is
# known to be converged, and only then asks for a factor. It is what
# `mlrt-compare speed-error` does, step by step.
#
# `MLRT_NOTEBOOKS=small` in the environment chooses settings that take a few seconds and are
# too small to say anything about speed.

# %%
import os
import tempfile
from pathlib import Path

import mlrt_plugin  # before Mitsuba: it tells Dr.Jit which libLLVM to take

SMALL = os.environ.get("MLRT_NOTEBOOKS") == "small"
SCENE = Path("../../scenes/office/office.xml")
RESOLUTION = (96, 96) if SMALL else (256, 256)
SPP = (1, 2, 4, 8) if SMALL else (1, 2, 4, 8, 16, 32, 64)
ROUNDS = 6 if SMALL else 16
REFERENCE_FACTOR = 64  # samples of the reference over the most samples measured
LEAST_SECONDS = 0.0 if SMALL else 0.05  # that a measurement of time lasts

mlrt_plugin.__version__

# %% [markdown]
# Each round renders every number of samples with both, in turns, with the same seeds. The
# references are kept in a cache, so a second run is shorter.

# %%
from mlrt_compare.machine import machine_of_comparison
from mlrt_compare.reference_cache import ReferenceCache
from mlrt_compare.settings import Settings
from mlrt_compare.speed_error import Plan, measure

machine = machine_of_comparison()  # with the load before anything is measured
settings = Settings(SCENE, resolution=RESOLUTION)
cache = ReferenceCache(Path(tempfile.mkdtemp()) if SMALL else None)
measured = measure(settings, Plan(SPP, ROUNDS, REFERENCE_FACTOR, LEAST_SECONDS), cache)
print(*measured.names, sep=" and ")

# %% [markdown]
# ## What an error looks like
#
# The same picture with the fewest and the most samples, and the reference that errors are
# taken against. The reference must look clean: its own noise is estimated from the spread
# of its 64 batches and taken off all errors.

# %%
import matplotlib.pyplot as plt
from mlrt_compare.mlrt_renderer import MlrtRenderer
from mlrt_compare.report import to_srgb8

renderer = MlrtRenderer(settings)
pictures = {}
for spp in (SPP[0], SPP[-1]):
    renderer.frame(spp=spp)
    pictures[f"samples a pixel: {spp}"] = to_srgb8(renderer.image)
reference = measured.references[1]
pictures[f"reference: {reference.spp}"] = to_srgb8(reference.mean)

figure, axes = plt.subplots(1, 3, figsize=(13, 4.6), layout="constrained")
for axis, (title, picture) in zip(axes, pictures.items(), strict=True):
    axis.imshow(picture)
    axis.set_title(title, loc="left")
    axis.axis("off")
plt.show()

# %% [markdown]
# ## The curves
#
# Both axes are logarithmic; each point is a number of samples. **Further left** at the same
# height is less time for the same error, **further down** is less error in the same time.
# Points of the same number must lie at the same height, as both take the same samples. At
# the left ends the curves bend: that is what a frame costs before its first sample.

# %%
from IPython.display import Image, Markdown
from mlrt_compare.error_plot import COLOURS
from mlrt_compare.speed_error_figures import figures_of
from mlrt_compare.speed_error_text import estimate, markdown, plot

figures = figures_of(measured, machine) | {"scene": SCENE.name}
Image(plot(figures, "png"), width=720)

# %% [markdown]
# ## May it be called a speed-up?
#
# Three things must hold first. The MSE must fall with the number of samples to the power of
# **-1**: another slope is a bias, or samples that are not independent. The **MSE at equal
# samples** must be the same on both sides. And the means of both references must agree:
# Welch's t-test gives a p-value for each tile of 16 x 16 pixels, and without a bias these
# are spread evenly from 0 to 1. A pile at the left is a bias.

# %%
import numpy as np

figure, (slopes, tiles) = plt.subplots(1, 2, figsize=(12, 4), layout="constrained")
for side, colour, size in zip(figures["sides"], COLOURS, (10, 5), strict=True):
    errors = [point["mse"] for point in side["points"]]
    label = f"{side['name']}: slope {estimate(side['slope'], 3)}"
    slopes.loglog(SPP, errors, "o-", color=colour, label=label, markersize=size)
slopes.loglog(SPP, errors[0] * SPP[0] / np.array(SPP), "k:", label="slope -1")
slopes.set_xticks(SPP, SPP, minor=False)
slopes.set_xticks([], minor=True)
slopes.set(xlabel="samples a pixel", ylabel="MSE")
slopes.set_title("Convergence", loc="left")
slopes.legend(fontsize=8)
counts = figures["bias"]["p_histogram"]
width = 1 / len(counts)
tiles.bar(width * np.arange(len(counts)), counts, width, align="edge", color="0.6")
tiles.axhline(sum(counts) / len(counts), color="black", linestyle=":")
tiles.set(xlabel="p-value of a tile", ylabel="tiles", xlim=(0, 1))
tiles.set_title("Bias test; without a bias as flat as chance allows", loc="left")
plt.show()

# %% [markdown]
# ## The figures
#
# Factors are Mitsuba's over MLRT's, so above 1 where MLRT is better; where an interval
# contains 1 there is no winner. At *equal time* the factor is in MSE, at *equal error* in
# seconds. A dash stands where the curves do not overlap. Cold starts stand in a table of
# their own, and the last line says how many frames they are worth. With a `load` of the
# machine far above 0 others used it too: the errors stand, the times should be taken again.

# %%
Markdown(markdown(figures))
