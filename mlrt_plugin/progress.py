"""A progress bar on standard error for work that takes a while."""

from __future__ import annotations

import sys
from types import TracebackType

from tqdm import tqdm

DELAY = 0.5
"""Seconds of work before the bar appears; chosen, so that quick work shows none."""


class ProgressBar:
    """Shows the share of the work that is done, on a terminal only.

    Used as a context and called with that share, from 0 to 1.
    """

    def __init__(self, label: str) -> None:
        self._bar = tqdm(
            total=1.0,
            desc=label,
            file=sys.stderr,
            disable=not sys.stderr.isatty(),
            delay=DELAY,
            leave=False,
            bar_format="{desc}: {percentage:3.0f}%|{bar}| {elapsed}<{remaining}",
        )

    def __call__(self, share: float) -> None:
        self._bar.update(share - self._bar.n)

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bar.close()
