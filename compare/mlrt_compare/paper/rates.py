"""Table 3: frames a second, without and with shadow rays, on some numbers of threads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mlrt_plugin.threads import thread_count

from ..bench.table import plural
from .frame_times import time_in_turns
from .scenes import StudiedScene
from .ways import TIMED


def frame_rates(
    studied: StudiedScene,
    threads: Sequence[int],
    repeats: int,
    counted: Mapping[str, Any],
) -> list[dict[str, Any]]:
    """A block for each number of threads and kind of rays: summaries of frames, by the
    key of the way.

    counted: of each way, by its key, what `count_ways` found, with shadow rays. Ways that
    were too slow there are not timed with these.
    """
    cpu = [counted.get(way.key, {}).get("cpu_seconds", 0.0) for way in TIMED]
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
                    [seconds / count for seconds in cpu] if shadows else (),
                )
            blocks.append(
                {
                    "threads": count,
                    "shadows": shadows,
                    "ways": {way.key: w for way, w in zip(TIMED, ways, strict=True)},
                }
            )
    return blocks
