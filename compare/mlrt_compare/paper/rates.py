"""Table 3: frames a second, without and with shadow rays, on some numbers of threads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mlrt_plugin.threads import thread_count

from ..bench.table import plural
from .frame_times import time_in_turns
from .scenes import StudiedScene
from .ways import TIMED


def frame_rates(
    studied: StudiedScene, threads: Sequence[int], repeats: int
) -> list[dict[str, Any]]:
    """A block for each number of threads and kind of rays: summaries of frames, by the
    key of the way."""
    blocks = []
    for count in threads:
        for shadows in (False, True):
            status = f"{studied.scene.name}: frames, {plural(count)}"
            with thread_count(count):
                ways = time_in_turns(
                    studied.prepared(shadows),
                    [way.options for way in TIMED],
                    count,
                    repeats,
                    status,
                )
            blocks.append(
                {
                    "threads": count,
                    "shadows": shadows,
                    "ways": {way.key: w for way, w in zip(TIMED, ways, strict=True)},
                }
            )
    return blocks
