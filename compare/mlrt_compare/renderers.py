"""What all renderers have in common."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class Renderer(Protocol):
    """A loaded scene that can be rendered as often as one likes."""

    @property
    def name(self) -> str: ...

    @property
    def load(self) -> float:
        """Seconds from the scene file to memory, without ``build``."""

    @property
    def build(self) -> float | None:
        """Seconds of the acceleration structure; None if nobody tells."""

    @property
    def warnings(self) -> Sequence[str]: ...

    @property
    def image(self) -> NDArray[np.float32]:
        """The last frame, (H, W, 3) of linear radiance."""

    def frame(self, *, spp: int | None = None, seed: int | None = None) -> float:
        """Renders a frame and returns the seconds that it took."""
