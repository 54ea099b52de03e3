"""Tables 1 and 2: steps and tests, with and without entry points."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from ..bench.status import show_status
from .counts import KINDS, counts_of
from .scenes import StudiedScene
from .ways import COUNTED


def count_ways(studied: StudiedScene) -> dict[str, Any]:
    """Counts of each way, by the key of the way and the kind of rays, and whether all ways
    gave one image, bit for bit.

    What each took tells which are too slow to be timed, no more."""
    ways: dict[str, Any] = {}
    images = []
    for way in COUNTED:
        show_status(f"{studied.scene.name}: counting, {way.name}")
        start = time.process_time()
        result = studied.lit.render(**way.options)
        images.append(result.image)
        ways[way.key] = {
            "options": way.options,
            **{
                kind: counts_of(result.counters, kind, studied.rays).as_dict()
                for kind in KINDS
            },
            "counters": result.counters,
            "cpu_seconds": time.process_time() - start,
        }
    show_status("")
    first = images[0].view(np.uint32)
    return {
        "ways": ways,
        "one_image": all(np.array_equal(first, image.view(np.uint32)) for image in images),
    }
