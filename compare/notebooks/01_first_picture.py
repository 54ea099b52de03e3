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
# # A first picture
#
# A Mitsuba scene file goes in, an image comes out. The scene is an office of about 800
# triangles with a point light and a desk lamp; any other scene that Mitsuba loads can stand
# in its place.
#
# `MLRT_NOTEBOOKS=small` in the environment chooses settings that take a second.

# %%
import os
from pathlib import Path

import mlrt_plugin

SMALL = os.environ.get("MLRT_NOTEBOOKS") == "small"
SCENE = Path("../../scenes/office/office.xml")
RESOLUTION = (192, 192) if SMALL else (512, 512)
SPP = 4 if SMALL else 64

mlrt_plugin.isa

# %% [markdown]
# `prepare` reads the scene and builds the kd-tree, once. It also decides who shades: this
# package, if it knows every plugin of the scene, or else Mitsuba's plugins on the hits that
# this package finds.

# %%
prepared = mlrt_plugin.prepare(SCENE, resolution=RESOLUTION)
print(prepared.shading)

# %% [markdown]
# `render` may then be called as often as one likes. The image is an array of linear
# radiance, so for the screen it is converted to sRGB. It is direct light only: what no
# lamp reaches is black, as the walls light nothing. Dark dots are noise: each sample asks
# one of the two lamps, and where that is the desk lamp, but hidden, it finds no light.

# %%
import matplotlib.pyplot as plt
from mlrt_compare.report import to_srgb8

result = prepared.render(spp=SPP, aovs=("depth", "normal", "prim"))
figure, axes = plt.subplots(figsize=(6, 6), layout="constrained")
axes.imshow(to_srgb8(result.image))
axes.set_title(f"{SCENE.stem}: {SPP} samples a pixel", loc="left")
axes.axis("off")
plt.show()

# %% [markdown]
# The same rays tell more. **Depth** is the distance from the near plane in metres.
# **Normals** are drawn with x, y and z as red, green and blue: all that is level has the
# colour of the floor, and each wall its own. **Faces** have a random colour for each
# triangle, so the mesh shows: large ones for walls and floor, tiny ones for round things.
# What is black there was hit by no ray: there is a gap beside the window.

# %%
import numpy as np

colours = np.random.default_rng(1).uniform(0.2, 1, (int(result.aovs["prim"].max()) + 1, 3))
faces = np.where(
    (result.aovs["prim"] >= 0)[..., None], colours[result.aovs["prim"]], (0, 0, 0)
)

figure, axes = plt.subplots(1, 3, figsize=(13, 4.4), layout="constrained")
depth = axes[0].imshow(result.aovs["depth"], cmap="viridis")
figure.colorbar(depth, ax=axes[0], label="metres", shrink=0.85)
axes[1].imshow(0.5 + 0.5 * np.clip(result.aovs["normal"], -1, 1))
axes[2].imshow(faces)
for axis, title in zip(axes, ("depth", "normal", "face"), strict=True):
    axis.set_title(title, loc="left")
    axis.axis("off")
plt.show()

# %% [markdown]
# What it took, in seconds of this machine, and what the kd-tree is like. `load` is mostly
# Mitsuba's parser and its loaders of meshes; `build` and `render` are this package's. The
# first two are paid once a scene, the last for each image.

# %%
for name, seconds in result.timings.items():
    print(f"{name:<8}{seconds:9.4f} s")
for name in ("triangles", "nodes", "leaves", "depth", "references_per_triangle"):
    print(f"{name:<24}{prepared.report[name]:>8.4g}")

# %% [markdown]
# **What to try.** Another `seed=` gives other noise and the same picture; twice as many
# samples halve the variance. `traversal="single"` or `builder="fast"` change the time but
# not a bit of the image.

# %%
again = prepared.render(spp=SPP, traversal="single")
print("the same image, bit for bit:", np.array_equal(result.image, again.image))
