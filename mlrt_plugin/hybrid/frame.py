"""Renders the film of a sensor of Mitsuba in passes that fit into memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr
import numpy as np
import numpy.typing as npt

from .. import mitsuba_objects as objects
from .direct_light import PrimaryHits
from .samplers import IndependentStream, Pass, mitsubas_sampler, passes

AOV_CHANNELS = {"depth": 1, "normal": 3, "moment": 6}
"""Numbers a pixel of those AOVs that are filtered as colours are."""


class Light(Protocol):
    """What computes the radiance along rays, see `DirectLight`."""

    def radiance(self, ray: Any, sampler: Any) -> tuple[Any, PrimaryHits]: ...


@dataclass(frozen=True)
class FilmArea:
    """The pixels of a film that are rendered, in the film's own numbers."""

    x: int
    y: int
    width: int
    height: int

    @property
    def pixels(self) -> int:
        return self.width * self.height

    @staticmethod
    def of(film: Any) -> FilmArea:
        """The crop window, and around it the border of the filter if that is sampled."""
        (x, y), (width, height) = film.crop_offset(), film.crop_size()
        border = int(film.rfilter().border_size()) if film.sample_border() else 0
        return FilmArea(
            int(x) - border,
            int(y) - border,
            int(width) + 2 * border,
            int(height) + 2 * border,
        )


class Frame:
    """Sums up the samples of a film: colours, AOVs, and the face in each pixel."""

    def __init__(self, module: Any, film: Any, aovs: Sequence[str], spp: int) -> None:
        self._module = module
        self._film = film
        self._filtered = [name for name in aovs if name in AOV_CHANNELS]
        self.area = FilmArea.of(film)
        self.spp = spp
        channels = 4 + sum(AOV_CHANNELS[name] for name in self._filtered)
        self._block = module.ImageBlock(
            film.crop_size(),
            film.crop_offset(),
            channels,
            film.rfilter(),
            border=False,
            coalesce=spp >= 4,
        )
        self._sums: npt.NDArray[np.float64] | None = None
        self._layer = (0, 0)
        self._faces = (
            dr.full(module.Int32, -1, self.area.pixels) if "prim" in aovs else None
        )

    def put(self, part: Pass, place: Any, color: Any, primary: PrimaryHits) -> None:
        """Adds the samples of a pass at places in pixels."""
        module, si = self._module, primary.interaction
        layer = (part.wavefront, part.start)
        if layer != self._layer:
            self._layer = layer
            self._take_down()
        values = {
            "depth": lambda: [dr.select(si.is_valid(), si.t, 0)],
            "normal": lambda: list(dr.select(si.is_valid(), si.sh_frame.n, 0)),
            "moment": lambda: moments(module, color),
        }
        channels = [color.x, color.y, color.z]
        for name in self._filtered:
            channels += values[name]()
        self._block.put(place, [*channels, dr.full(module.Float, 1, part.count)])
        if self._faces is not None:
            pixel, sample = part.pixel_and_sample(module)
            first = sample == 0
            first &= dr.opaque(module.UInt32, part.wavefront) == 0
            dr.scatter(self._faces, primary.face, pixel, first)
            dr.eval(self._faces)
        dr.eval(self._block.tensor())

    def _take_down(self) -> None:
        """Adds what the film holds in double precision, and empties the film."""
        values = np.array(self._block.tensor(), np.float64)
        self._sums = values if self._sums is None else self._sums + values
        self._block.clear()

    def image(self) -> npt.NDArray[np.float32]:
        """Colours, (H, W, 3)."""
        return self._developed(0, 3)

    def aovs(self) -> dict[str, npt.NDArray[Any]]:
        """AOVs by name: (H, W) or (H, W, 3)."""
        images: dict[str, npt.NDArray[Any]] = {}
        start = 3
        for name in self._filtered:
            plane = self._developed(start, AOV_CHANNELS[name])
            images[name] = plane[..., 0] if AOV_CHANNELS[name] == 1 else plane
            start += AOV_CHANNELS[name]
        if self._faces is not None:
            area = self.area
            faces = np.array(self._faces, np.int32).reshape(area.height, area.width)
            width, height = (int(n) for n in self._film.crop_size())
            left, top = (area.width - width) // 2, (area.height - height) // 2
            images["prim"] = faces[top : top + height, left : left + width].copy()
        return images

    def _developed(self, start: int, count: int) -> npt.NDArray[np.float32]:
        # Not a copy: large films hold gigabytes.
        sums = self._block.tensor().numpy()
        if self._sums is not None:
            sums = self._sums + sums
        weight = sums[..., -1:]
        channels = sums[..., start : start + count]
        image = np.zeros(channels.shape, np.float32)
        np.divide(channels, weight, out=image, where=weight != 0)
        return image


def moments(module: Any, color: Any) -> list[Any]:
    """Of samples, in CIE XYZ, and their squares, as the integrator `moment` has them
    (moment.cpp)."""
    xyz = list(module.srgb_to_xyz(color))
    return xyz + [dr.square(value) for value in xyz]


def render_frame(
    module: Any,
    sensor: Any,
    light: Light,
    *,
    spp: int,
    seed: int,
    aovs: Sequence[str],
    progress: Callable[[float], object] | None,
) -> Frame:
    """Renders what a sensor sees; to `seed` that of its sampler is added.

    The image of sampler `independent` depends on the passes only in its rounding. Other
    samplers cannot be entered in the middle, so they are seeded anew for each pass.
    """
    film, sampler = sensor.film(), sensor.sampler()
    frame = Frame(module, film, aovs, spp)
    independent = sampler.class_name() == "IndependentSampler"
    own_seed = (seed + int(objects.described(sampler, "base_seed", "0"))) & 0xFFFFFFFF
    done = 0
    for number, part in enumerate(passes(frame.area.pixels, spp, not independent)):
        numbers = (
            IndependentStream(module, own_seed, part)
            if independent
            else mitsubas_sampler(sampler, spp, (seed + number) & 0xFFFFFFFF, part.count)
        )
        place, ray, weight = camera_rays(module, sensor, numbers, frame, part)
        color, primary = light.radiance(ray, numbers)
        frame.put(part, place, weight * color, primary)
        done += part.count
        if progress is not None:
            progress(done / (frame.area.pixels * spp))
    return frame


def camera_rays(
    module: Any, sensor: Any, numbers: Any, frame: Frame, part: Pass
) -> tuple[Any, Any, Any]:
    """Rays of the samples of a pass: where they count on the film, in pixels; the rays; and
    what their radiance is multiplied by."""
    film, area = sensor.film(), frame.area
    pixel, _ = part.pixel_and_sample(module)
    width = dr.opaque(module.UInt32, area.width)
    row = pixel // width
    column = pixel - row * width
    corner = module.Vector2f(
        module.Float(module.Int32(column) + area.x),
        module.Float(module.Int32(row) + area.y),
    )
    place = corner + numbers.next_2d()
    scale = dr.rcp(module.ScalarVector2f(film.crop_size()))
    offset = -module.ScalarVector2f(film.crop_offset()) * scale
    aperture = module.Point2f(0.5)
    if sensor.needs_aperture_sample():
        aperture = numbers.next_2d()
    time = module.Float(sensor.shutter_open())
    if sensor.shutter_open_time() > 0:
        time += numbers.next_1d() * sensor.shutter_open_time()
    ray, weight = sensor.sample_ray_differential(
        time, 0, dr.fma(place, scale, offset), aperture
    )
    if ray.has_differentials:
        ray.scale_differential(dr.rsqrt(module.ScalarFloat(frame.spp)))
    # Rounding may carry a sample into the next pixel, and a box filter does not care where
    # in the pixel it is (integrator.cpp).
    counted = corner if film.rfilter().is_box_filter() else place
    return counted, ray, weight
