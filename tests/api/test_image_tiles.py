"""Tiles and their entry points, against Mitsuba's camera rays and every triangle."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
import repository

import mlrt_plugin
from mlrt_plugin.image_plane import image_plane
from mlrt_plugin.image_tiles import ImageTile, image_tiles

OFFICE = repository.ROOT / "scenes" / "office" / "office.xml"
SIZE = (80, 56)
"""No multiple of the tiles."""


@pytest.fixture(scope="module")
def office() -> Any:
    return mlrt_plugin.prepare(OFFICE, resolution=SIZE)


@pytest.fixture(scope="module")
def hit_points(office: Any) -> np.ndarray[Any, Any]:
    """(H, W, 3) first hits of Mitsuba's rays through the pixels' centres, found without
    the tree; NaN for misses."""
    mi.set_variant("scalar_rgb")
    scene = mi.load_file(str(OFFICE), resx=SIZE[0], resy=SIZE[1])
    sensor = scene.sensors()[0]
    rays = []
    for y in range(SIZE[1]):
        for x in range(SIZE[0]):
            place = mi.Point2f((x + 0.5) / SIZE[0], (y + 0.5) / SIZE[1])
            ray, _ = sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
            rays.append((*ray.o, *ray.d))
    table = np.array(rays, np.float32)
    tree = mlrt_plugin.KdTree(office.arrays.vertices, office.arrays.faces)
    hits = tree.closest_hit(table[:, :3], table[:, 3:], traversal="brute_force")
    points = table[:, :3] + hits.t[:, None].astype(np.float64) * table[:, 3:]
    points[hits.primitive < 0] = np.nan
    return points.reshape(SIZE[1], SIZE[0], 3)


def test_hits_project_to_their_pixels(office: Any, hit_points: Any) -> None:
    plane = image_plane(office.arrays.camera, office.arrays.film)
    there = np.isfinite(hit_points[..., 0])
    assert there.mean() > 0.9
    positions, depths = plane.project(hit_points[there])
    rows, columns = np.nonzero(there)
    assert np.all(depths > 0)
    np.testing.assert_allclose(positions[:, 0], columns + 0.5, atol=0.01)
    np.testing.assert_allclose(positions[:, 1], rows + 0.5, atol=0.01)
    behind = 2 * plane.origin - hit_points[there]
    assert np.all(plane.project(behind)[1] < 0)


@pytest.mark.parametrize("split_factor", [4, 16])
def test_cells_hold_what_their_tiles_hit(
    office: Any, hit_points: Any, split_factor: int
) -> None:
    tiles = image_tiles(office, initial_tile=32, minimum_tile=8, split_factor=split_factor)
    for tile in tiles:
        seen = hit_points[tile.y : tile.y + tile.height, tile.x : tile.x + tile.width]
        seen = seen[np.isfinite(seen[..., 0])]
        if tile.cell is None:
            assert len(seen) == 0
            continue
        # Of hits the points are rounded, the cells are not.
        assert np.all(seen >= tile.cell[0] - 1e-4) and np.all(seen <= tile.cell[1] + 1e-4)
    depths = {tile.depth for tile in tiles}
    assert len(depths) > 4 and max(depths - {None}) > 6


def test_tiles_cut_the_image_up(office: Any) -> None:
    tiles = image_tiles(office, initial_tile=32, minimum_tile=8)
    covered = np.zeros(SIZE[::-1], int)
    for tile in tiles:
        assert tile.x + tile.width <= SIZE[0] and tile.y + tile.height <= SIZE[1]
        if not tile.split:
            covered[tile.y : tile.y + tile.height, tile.x : tile.x + tile.width] += 1
    assert np.all(covered == 1)
    assert tiles[0].width == 32 and tiles[0].split
    assert {tile.width for tile in tiles} == {32, 16, 8}


def test_parts_enter_at_least_as_deep(office: Any) -> None:
    tiles = image_tiles(office, initial_tile=64, minimum_tile=4, covering_triangles=False)
    found = 0
    for number, tile in enumerate(tiles):
        for part in tiles[number + 1 :]:
            if not is_part(part, tile):
                break
            if part.depth is None:
                continue
            assert tile.depth is not None and tile.cell is not None
            assert part.cell is not None and part.depth >= tile.depth
            assert np.all(part.cell[0] >= tile.cell[0])
            assert np.all(part.cell[1] <= tile.cell[1])
            found += part.depth > tile.depth
    assert found > 10


def is_part(part: ImageTile, tile: ImageTile) -> bool:
    return (
        tile.x <= part.x
        and tile.y <= part.y
        and part.x + part.width <= tile.x + tile.width
        and part.y + part.height <= tile.y + tile.height
    )


def test_crop_has_the_tiles_of_its_part_of_the_image(office: Any) -> None:
    film = replace(office.arrays.film, crop_x=32, crop_y=16, crop_width=32, crop_height=32)
    cropped = mlrt_plugin.prepare(replace(office.arrays, film=film))
    sizes = {"initial_tile": 4, "minimum_tile": 4}
    whole = {(tile.x, tile.y): tile.node for tile in image_tiles(office, **sizes)}
    part = {(tile.x + 32, tile.y + 16): tile.node for tile in image_tiles(cropped, **sizes)}
    assert len(part) == 64 and part.items() <= whole.items()
    assert len(set(part.values())) > 5


def test_a_lazy_tree_is_entered_as_deep_as_it_is_built() -> None:
    lazy = mlrt_plugin.prepare(OFFICE, resolution=SIZE, builder="lazy")
    assert {tile.depth for tile in image_tiles(lazy)} == {0}
    lazy.render(spp=1)
    assert len({tile.depth for tile in image_tiles(lazy)}) > 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"initial_tile": 48}, "initial_tile = 48 is no power of two"),
        ({"minimum_tile": 2}, "minimum_tile = 2 is no power of two from 4"),
        ({"split_factor": 8}, "split_factor = 8 does not exist"),
        ({"traversal": "packet"}, "unknown option 'traversal'"),
        ({"initial_tile": 8.5}, "initial_tile must be a whole number"),
    ],
)
def test_bad_arguments(office: Any, options: dict[str, Any], said: str) -> None:
    with pytest.raises((mlrt_plugin.MlrtError, TypeError), match=said):
        image_tiles(office, **options)


def test_a_scene_that_mitsuba_shades() -> None:
    class Hybrid:
        shading = "mitsuba, because it is a test"

    with pytest.raises(mlrt_plugin.MlrtError, match="shaded natively only"):
        image_tiles(Hybrid())  # type: ignore[arg-type]
