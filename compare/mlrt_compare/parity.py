"""Equal-sample parity: MLRT's image against that of Mitsuba's `direct` with the same seed,
and the pixels in which intersections differ set apart and judged."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import drjit as dr
import numpy as np
import numpy.typing as npt

from mlrt_plugin.hybrid.frame import FilmArea, render_frame
from mlrt_plugin.hybrid.prepared import PreparedHybrid
from mlrt_plugin.hybrid.samplers import MOST_SUMMANDS
from mlrt_plugin.parsing import resolving_from
from mlrt_plugin.render import prepare

from .adjudication import Judgement, adjudicate, decided_by_rounding
from .metrics import differing_mask
from .mitsuba_renderer import MitsubaRenderer
from .mlrt_renderer import MlrtRenderer
from .options import CannotRun
from .settings import Settings
from .timing import interleave
from .twin_hits import Findings, TwinLight

LARGEST_RMSE = 1e-4
"""Of the mean of the image, outside of pixels in which intersections differ."""
MOST_ROUNDED = 0.1
"""Share of the pixels that rounding may decide; where more differ, it is not asked, which
takes a while. Chosen: 6 of 10,000 differ in the worst third-party scene."""
ROUNDS = 1

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Parity:
    """What became of a scene on one of the paths.

    disputed_pixels: in which a ray of MLRT and that of Mitsuba hit different things.
    rounded_pixels: in which MLRT's own rays differ from Mitsuba's by rounding, and that
    decides what they hit; of the native path only. differing_pixels: others whose values
    differ by more than 1e-3.
    rmse: of all pixels but the disputed and the rounded ones, over the mean of the image.
    """

    scene: str
    path: str
    reason: str
    width: int
    height: int
    spp: int
    integrator: str
    load: float
    build: float
    first: float
    steady: float
    mitsuba_first: float
    mitsuba_steady: float
    rays: int
    judgement: Judgement
    disputed_pixels: int
    rounded_pixels: int
    differing_pixels: int
    rmse: float
    warnings: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether MLRT's image is Mitsuba's, and no exact answer speaks against it."""
        return self.rmse < LARGEST_RMSE and self.judgement.ours_wrong == 0

    def as_dict(self) -> dict[str, Any]:
        return {**asdict(self), "passed": self.passed}


def parity(settings: Settings) -> Parity:
    """As `parity_and_pixels_apart`, of which it raises the errors."""
    return parity_and_pixels_apart(settings)[0]


def parity_and_pixels_apart(settings: Settings) -> tuple[Parity, Mask]:
    """Renders a scene by MLRT, by Mitsuba, and by the twin that tells which rays differ.

    Returns also, (H, W), which pixels are disputed or decided by rounding.

    `settings.shading` chooses the path. Raises MlrtError if it cannot be rendered,
    and CannotRun for too many samples.
    """
    ours = MlrtRenderer(settings)
    if ours.spp > MOST_SUMMANDS:
        raise CannotRun(f"rays are told apart up to {MOST_SUMMANDS} spp, not {ours.spp}")
    theirs = MitsubaRenderer(settings, ours.integrator)
    first, mitsuba_first = ours.frame(), theirs.frame()
    frames, mitsuba_frames = interleave(ours.frame, theirs.frame, ROUNDS)
    image, reference = ours.image, theirs.image
    twin = prepared_twin(settings)
    findings, area = twin_frame(twin, ours, settings)
    disputed = mask_of(findings.disputed_pixels(), area, twin, image)
    differing = differing_mask(image, reference)
    rounded = np.zeros_like(disputed)
    unexplained = differing & ~disputed
    if not ours.by_mitsuba and 0 < np.mean(unexplained) < MOST_ROUNDED:
        rounded = unexplained & rounding_mask(twin, ours, settings, differing)
    others = ~(disputed | rounded)
    mean = float(np.mean(reference, dtype=np.float64))
    delta = (image.astype(np.float64) - reference)[others]
    rmse = float(np.sqrt(np.mean(delta**2))) if delta.size else 0.0
    kinds = ours.integrator
    figures = Parity(
        scene=str(settings.scene),
        path="mitsuba" if ours.by_mitsuba else "native",
        reason=ours.shading.partition("because ")[2],
        width=image.shape[1],
        height=image.shape[0],
        spp=ours.spp,
        integrator=" ".join(
            [str(kinds["type"])]
            + [str(n) for name, n in kinds.items() if name.endswith("_samples")]
        ),
        load=ours.load,
        build=ours.build,
        first=first,
        steady=float(np.median(frames)),
        mitsuba_first=mitsuba_first,
        mitsuba_steady=float(np.median(mitsuba_frames)),
        rays=findings.ray_count,
        judgement=adjudicate(findings.disputes, twin.faces, twin.others is not None),
        disputed_pixels=int(np.count_nonzero(disputed)),
        rounded_pixels=int(np.count_nonzero(rounded)),
        differing_pixels=int(np.count_nonzero(differing & others)),
        rmse=rmse / mean if mean > 0 else math.inf,
        warnings=(*ours.warnings, *theirs.warnings),
    )
    return figures, disputed | rounded


def prepared_twin(settings: Settings) -> PreparedHybrid:
    """The scene on the path that lets Mitsuba's code see every ray."""
    with resolving_from(*settings.folders):
        twin = prepare(
            settings.scene,
            sensor=settings.sensor,
            defines=settings.defines,
            resolution=settings.resolution,
            shading="mitsuba",
            force_direct=True,
        )
    assert isinstance(twin, PreparedHybrid)
    return twin


def twin_frame(
    twin: PreparedHybrid, ours: MlrtRenderer, settings: Settings, watch: Any = ()
) -> tuple[Findings, FilmArea]:
    """Takes the samples of a frame on the hits of MLRT and on Embree's; see `TwinLight`."""
    kinds = ours.integrator
    depth = kinds["type"] != "direct"
    light = TwinLight(
        twin,
        0 if depth else int(kinds["emitter_samples"]),
        0 if depth else int(kinds["bsdf_samples"]),
        ours.spp,
        watch,
    )
    with dr.suspend_grad():  # type: ignore[no-untyped-call]
        frame = render_frame(
            twin.loaded.module,
            twin.loaded.sensor,
            light,
            spp=ours.spp,
            seed=settings.seed,
            aovs=(),
            progress=None,
        )
    return light.findings, frame.area


def rounding_mask(
    twin: PreparedHybrid, ours: MlrtRenderer, settings: Settings, differing: Mask
) -> Mask:
    """The pixels that rays reach which rounding lets hit something else, among the
    neighbourhood of those that differ."""
    area = FilmArea.of(twin.loaded.sensor.film())
    watch = np.flatnonzero(in_area(grown(differing, reach_of(twin)), area))
    findings, _ = twin_frame(twin, ours, settings, watch)
    found = decided_by_rounding(findings.watched, twin.tree)
    return mask_of(found, area, twin, differing)


def reach_of(twin: PreparedHybrid) -> int:
    """How many pixels away a sample counts."""
    rfilter = twin.loaded.sensor.film().rfilter()
    return 0 if rfilter.is_box_filter() else math.floor(float(rfilter.radius()) + 0.5)


def mask_of(
    pixels: npt.NDArray[np.int64], area: FilmArea, twin: PreparedHybrid, image: Any
) -> Mask:
    """(H, W) pixels of the image that samples in some pixels of the area count in."""
    mask = np.zeros(area.pixels, bool)
    mask[pixels] = True
    whole = grown(mask.reshape(area.height, area.width), reach_of(twin))
    height, width = image.shape[:2]
    top, left = (area.height - height) // 2, (area.width - width) // 2
    return whole[top : top + height, left : left + width]


def in_area(mask: Mask, area: FilmArea) -> Mask:
    """A mask of the image as one of the area around it."""
    rows, columns = area.height - mask.shape[0], area.width - mask.shape[1]
    return np.pad(
        mask, ((rows // 2, rows - rows // 2), (columns // 2, columns - columns // 2))
    )


def grown(mask: Mask, reach: int) -> Mask:
    """The pixels within `reach` rows and columns of those of a mask."""
    height, width = mask.shape
    padded = np.pad(mask, reach)
    result = np.zeros_like(mask)
    for y in range(2 * reach + 1):
        for x in range(2 * reach + 1):
            result |= padded[y : y + height, x : x + width]
    return result
