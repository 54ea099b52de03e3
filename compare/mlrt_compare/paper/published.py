"""What Reshetov, Soupikov and Hurley published in 2005: tables 1, 2 and 3 of the paper.

Figures are those of the paper itself. Of reprints some exchange the columns of the
conference room and of soda hall, divide by 16 * 16 pixels in place of 4 * 4, or call tests
those of a ray; none of that is here.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class PublishedCounts:
    """Of a frame of 1024 x 1024 pixels, for each packet of 4 x 4 pixels.

    steps: nodes visited, those of entry point searches included.
    entry_steps: of these those of the searches; None where the paper does not tell.
    tests: triangles that a packet was tested against.
    """

    steps: float
    steps_without: float
    entry_steps: float | None
    tests: float
    tests_without: float

    @property
    def reduction(self) -> float:
        return self.steps_without / self.steps


@dataclass(frozen=True)
class PublishedRates:
    """Frames a second of 1024 x 1024 pixels, with one thread unless it says otherwise.

    OpenRT on a Pentium 4 of 2.5 GHz; MLRTA on one of 2.4 GHz, and, with two threads on one
    core, of 3.2 GHz.
    """

    openrt: float
    one_thread: float
    two_threads: float


@dataclass(frozen=True)
class PublishedScene:
    """A scene of the paper, and its rows.

    shaded: rates with a light at the camera, which needs no shadow rays.
    """

    name: str
    triangles: str
    primary: PublishedCounts
    with_shadows: PublishedCounts
    rates: PublishedRates | None = None
    shaded: PublishedRates | None = None


PUBLISHED = {
    "office": PublishedScene(
        "erw6",
        "804",
        PublishedCounts(3.98, 13.00, 0.51, 1.09, 1.09),
        PublishedCounts(10.07, 24.83, None, 1.25, 1.22),
        PublishedRates(7.1, 70.2, 109.8),
        PublishedRates(2.3, 37.8, 50.7),
    ),
    "conference": PublishedScene(
        "conference",
        "274K",
        PublishedCounts(20.87, 49.98, 2.30, 2.48, 2.55),
        PublishedCounts(53.73, 101.06, None, 3.71, 3.75),
        PublishedRates(4.55, 11.2, 19.5),
        PublishedRates(1.93, 9.5, 15.6),
    ),
    "building": PublishedScene(
        "soda hall",
        "2,195K",
        PublishedCounts(32.52, 71.37, 4.44, 1.59, 1.52),
        PublishedCounts(69.07, 117.22, None, 2.17, 2.09),
        PublishedRates(4.12, 21.1, 35.5),
        PublishedRates(1.8, 15.3, 24.1),
    ),
    "dragon": PublishedScene(
        "Asian dragon",
        "7.2M",
        PublishedCounts(32.65, 42.18, 2.72, 19.97, 19.94),
        PublishedCounts(45.01, 58.41, None, 23.51, 23.48),
    ),
}
"""By the scene of ours that stands in for each."""
