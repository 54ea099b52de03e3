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
# # Side by side with Mitsuba
#
# Both renderers get the same scene, the same samples and the same random numbers. Noise is
# then the same on both sides and cancels in the difference: what remains is where the two
# disagree about what a ray hits.
#
# `MLRT_NOTEBOOKS=small` in the environment chooses settings that take a few seconds.

# %%
import os
from pathlib import Path

import mlrt_plugin  # before Mitsuba: it tells Dr.Jit which libLLVM to take

SMALL = os.environ.get("MLRT_NOTEBOOKS") == "small"
SCENE = Path("../../scenes/office/office.xml")
RESOLUTION = (128, 128) if SMALL else (512, 512)
SPP = 4 if SMALL else 16

mlrt_plugin.__version__

# %%
from mlrt_compare.run import compare
from mlrt_compare.settings import Settings

settings = Settings(SCENE, spp=SPP, resolution=RESOLUTION)
comparison = compare(settings, rounds=1)
print(comparison.mlrt.name, "beside", comparison.mitsuba.name)
print(comparison.shading)

# %% [markdown]
# The upper two should be one picture. The **difference** is drawn ten times as bright as
# it is: orange where MLRT is brighter, blue where Mitsuba is, black where they agree. A
# structure in it (a surface, a shadow as a whole) would be an error of one of the two; a
# few single pixels at edges and shadow borders are rounding. The last picture marks in red
# the pixels in which a channel differs by more than 0.001 of the larger value.

# %%
import matplotlib.pyplot as plt
from mlrt_compare.report import marked, signed_difference, to_srgb8

ours, theirs = comparison.mlrt.image, comparison.mitsuba.image
pictures = {
    "MLRT": to_srgb8(ours),
    "Mitsuba": to_srgb8(theirs),
    "difference, 10 times as bright": signed_difference(ours, theirs),
    "pixels that differ": marked(ours, theirs),
}
figure, axes = plt.subplots(2, 2, figsize=(10, 10.4), layout="constrained")
for axis, (title, picture) in zip(axes.flat, pictures.items(), strict=True):
    axis.imshow(picture)
    axis.set_title(title, loc="left")
    axis.axis("off")
plt.show()

# %% [markdown]
# In numbers. The verdict fails if more than 0.1 % of the pixels differ, if a value is not
# finite, or if an image is black. The error of either image by its *noise* is far larger
# than what is told here, and the same for both; notebook 4 measures that.

# %%
for name, value in comparison.verdict.difference.as_dict().items():
    print(f"{name:<12}{value:12.4g}")
print(comparison.verdict)

# %% [markdown]
# A verdict is worth something only if it can fail. MLRT's image is moved by a pixel, made
# darker by 1 %, and given swapped channels: each must be caught.

# %%
import numpy as np
from mlrt_compare.validate import judge

spoiled = {
    "moved by a pixel": np.roll(ours, 1, axis=1),
    "darker by 1 %": np.float32(0.99) * ours,
    "red and blue swapped": ours[..., ::-1],
}
for name, image in spoiled.items():
    print(f"{name}: {judge(image, theirs)}")
