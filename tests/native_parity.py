"""Native images against those of Mitsuba's llvm `direct`, sample by sample."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from mlrt_compare.metrics import differing_mask
from mlrt_compare.mitsuba_renderer import MitsubaRenderer
from mlrt_compare.settings import Settings

from mlrt_plugin import prepare

SEED = 7
ROUNDING = 1e-4
"""Of the mean; Mitsuba's barycentrics are in single precision."""


def assert_parity(path: Path, **integrator: int) -> None:
    """Of a scene that takes the native path by itself.

    integrator: parameters of `direct` beside those of no BSDF sample.
    """
    prepared = prepare(path)
    assert prepared.shading.path == "native"
    image = prepared.render(seed=SEED).image
    reference = MitsubaRenderer(
        Settings(path, seed=SEED),
        {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, **integrator},
    )
    reference.frame()
    assert image.shape == reference.image.shape and image.max() > 0
    # Where a ray grazes an edge, Embree and the exact test may decide in different ways.
    differing = differing_mask(image, reference.image)
    assert np.count_nonzero(differing) <= max(2, differing.size // 500)
    error = np.sqrt(np.mean((image - reference.image)[~differing] ** 2))
    assert error < ROUNDING * reference.image.mean()
