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
# # What the kd-tree does
#
# A ray usually starts at the root of the tree and passes many nodes before it meets a
# triangle. Neighbouring rays pass the same ones. Multi-level ray tracing (Reshetov,
# Soupikov and Hurley 2005) takes a *tile* of rays as one beam, and searches the deepest
# node that holds all that the beam may hit: its **entry point**. All rays of the tile start
# there. This notebook draws these tiles and nodes, and counts what they save.
#
# `MLRT_NOTEBOOKS=small` in the environment chooses settings that take a few seconds.

# %%
import os
from pathlib import Path

import mlrt_plugin

SMALL = os.environ.get("MLRT_NOTEBOOKS") == "small"
SCENE = Path("../../scenes/office/office.xml")
RESOLUTION = (256, 256) if SMALL else (512, 512)

prepared = mlrt_plugin.prepare(SCENE, resolution=RESOLUTION)
tree = prepared.report
print(f"{tree['triangles']} triangles, {tree['nodes']} nodes, {tree['depth']} deep")

# %% [markdown]
# ## Tiles
#
# The image is cut into squares. A square is split into four until it is small, or until its
# entry point is a leaf. The colour is the depth of the entry point: **bright tiles** start
# deep in the tree and skip most of it, **dark ones** start near the root, because what they
# see lies on both sides of one of the first split planes. Look for the dark bands: they
# follow such planes across the image, where walls and ceiling meet and along furniture.
# Plain walls between them are bright, or of one colour. Furniture is bright where one
# triangle covers a whole tile, so that nothing behind it counts; along the diagonal of the
# back of a chair, where two triangles meet, neither does.

# %%
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle
from mlrt_compare.report import to_srgb8

tiles = mlrt_plugin.image_tiles(prepared, initial_tile=64, minimum_tile=8)
final = [tile for tile in tiles if not tile.split]
result = prepared.render(spp=16, aovs=("cost",))
picture = to_srgb8(result.image)
depths = [tile.depth for tile in final if tile.node is not None]
scale = plt.cm.ScalarMappable(plt.Normalize(0, np.percentile(depths, 98)), "inferno")

figure, axes = plt.subplots(1, 2, figsize=(13, 6.2), layout="constrained")
axes[0].imshow(picture)
axes[1].imshow(picture.mean(axis=-1), cmap="gray")
for tile in final:
    place = (tile.x - 0.5, tile.y - 0.5), tile.width, tile.height
    depth = 0 if tile.node is None else tile.depth
    axes[0].add_patch(Rectangle(*place, fill=False, edgecolor="white", linewidth=0.4))
    axes[1].add_patch(Rectangle(*place, color=scale.to_rgba(depth), alpha=0.7))
axes[0].set_title(f"{len(final)} tiles", loc="left")
axes[1].set_title("depth of the entry points", loc="left")
figure.colorbar(scale, ax=axes[1], label="nodes below the root", extend="max", shrink=0.85)
for axis in axes:
    axis.axis("off")
plt.show()

# %% [markdown]
# ## Entry points
#
# An entry point is a node, and a node is a box in space: its cell. Here are six tiles, from
# one that starts near the root to the one that starts deepest, each filled, with its cell
# in the same colour as the camera sees it. A cell is often much wider than its tile, or
# reaches out of the picture: it must hold what the tile's beam can **hit**, and whatever
# else is in it costs the tile nothing. Deep cells are flat or small: a piece of a wall, or
# something in front that hides all else, as the back of a chair.

# %%
from mlrt_plugin.image_plane import image_plane

plane = image_plane(prepared.arrays.camera, prepared.arrays.film)
near = prepared.arrays.camera.near_clip


def edges_of(cell):
    """The twelve edges of a box on the image; the part in front of the camera."""
    for axis in range(3):
        for corner in range(4):
            ends = np.empty((2, 3))
            ends[:, axis] = cell[:, axis]
            for number, other in enumerate({0, 1, 2} - {axis}):
                ends[:, other] = cell[corner >> number & 1, other]
            depths = plane.project(ends)[1]
            if max(depths) <= near:
                continue
            if min(depths) < near:
                behind = int(np.argmin(depths))
                share = (near - depths[behind]) / (depths[1 - behind] - depths[behind])
                ends[behind] += 1.001 * share * (ends[1 - behind] - ends[behind])
            yield plane.project(ends)[0]


by_depth = {tile.depth: tile for tile in final if tile.node is not None}
chosen = np.linspace(0, len(by_depth) - 1, 6).round().astype(int)
examples = [by_depth[sorted(by_depth)[number]] for number in chosen]

figure, axes = plt.subplots(2, 3, figsize=(13, 9), layout="constrained")
for axis, tile, colour in zip(
    axes.flat, examples, ("C1", "C2", "C4", "C6", "C8", "C9"), strict=True
):
    axis.imshow(picture // 2)
    axis.add_patch(
        Rectangle((tile.x - 0.5, tile.y - 0.5), tile.width, tile.height, color=colour)
    )
    for edge in edges_of(tile.cell):
        axis.plot(*(edge - 0.5).T, color=colour, linewidth=1.5)
    axis.set(xlim=(-0.5, RESOLUTION[0] - 0.5), ylim=(RESOLUTION[1] - 0.5, -0.5))
    axis.set_title(f"{tile.width} x {tile.height} pixels, depth {tile.depth}", loc="left")
    axis.axis("off")
plt.show()

# %% [markdown]
# ## Where the work is
#
# The AOV `cost` counts, for each pixel, the nodes that are visited and the triangles that
# are tested for its camera and shadow rays; rays that are traced together share alike.
# Three ways have the same scale: packets of 16 rays from the root, packets from entry
# points, and the default, where whole beams walk the tree. Bright pixels are at furniture,
# where many small triangles are in front of each other. Entry points darken walls and
# floor most, where all that is above the hit is skipped. The grain is that of the shadow
# rays: each pixel asks one of the two lamps.

# %%
ways = {
    "packets from the root": {"traversal": "packet", "entry_points": False},
    "packets from entry points": {"traversal": "packet"},
    "beams (the default)": {},
}
results = {
    name: prepared.render(spp=1, aovs=("cost",), **way) for name, way in ways.items()
}
top = np.percentile(results["packets from the root"].aovs["cost"], 99.5)

figure, axes = plt.subplots(1, 3, figsize=(13, 4.5), layout="constrained")
for axis, (name, way) in zip(axes, results.items(), strict=True):
    cost = way.aovs["cost"]
    drawn = axis.imshow(cost, cmap="inferno", vmin=0, vmax=top)
    axis.set_title(f"{name}: mean {cost.mean():.2f}", loc="left")
    axis.axis("off")
figure.colorbar(drawn, ax=axes, label="nodes and triangles a sample", shrink=0.85)
plt.show()

# %% [markdown]
# ## In numbers
#
# The same as counters of the camera rays, for a packet of 16. **Packet steps** are nodes
# that packets visit; **search steps** are what the searches of entry points cost, and
# **beam steps** are those of beams, so these three are to be added up. All ways return the
# same image: the way that rays take through the tree changes no hit.

# %%
from IPython.display import Markdown

names = {
    "packet steps": "traversal_steps",
    "search steps": "entry_steps",
    "beam steps": "beam_steps",
    "triangle tests, packets": "triangle_tests",
    "triangle tests, beams": "beam_triangles",
}
rows = ["| a packet of 16 rays | " + " | ".join(results) + " |", "|---" * 4 + "|"]
for name, counter in names.items():
    values = [
        16 * way.counters[f"primary_{counter}"] / way.counters["primary_rays"]
        for way in results.values()
    ]
    rows.append(f"| {name} | " + " | ".join(f"{value:.2f}" for value in values) + " |")
Markdown("\n".join(rows))

# %%
images = [way.image for way in results.values()]
print("the same image:", all(np.array_equal(image, images[0]) for image in images))

# %% [markdown]
# **What to try.** `minimum_tile=16` or `initial_tile=128` in the call of `image_tiles`; a
# scene of your own in the first cell; `search_order="paper"`, `culling="frustum_planes"` or
# `covering_triangles=False` as further arguments of `image_tiles` and `render`, to see what
# each of them is worth.
