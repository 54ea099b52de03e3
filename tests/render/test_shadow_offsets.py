"""Images with either offset of shadow rays, against visibility in double precision."""

from __future__ import annotations

import itertools

import drjit as dr
import numpy as np
import pytest
from mlrt_compare.bench.offset_scene import LIGHTS, Placement, hard_scene
from mlrt_compare.bench.offset_truth import blocked
from mlrt_compare.bench.offsets_command import measure

from mlrt_plugin.render import prepare

PLACEMENTS = [
    *(Placement(size=10.0**exponent) for exponent in (-6, -4, -1, 0, 3, 6)),
    *(Placement(shift=10.0**exponent) for exponent in (1, 3)),
]


@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("placement", PLACEMENTS, ids=lambda placement: placement.name)
def test_robust_offsets_neither_leak_nor_darken(
    light: str, placement: Placement, full: bool
) -> None:
    judgements, _ = measure(light, placement, 256 if full else 56, 3 if full else 2)
    robust = judgements["robust"]
    assert robust.lit > 1000
    assert robust.dark > 300
    assert (robust.acne, robust.leaks) == (0, 0)
    # Pixels of which nothing is known are few, or the claim is empty.
    assert robust.undecided <= (0 if placement.shift == 0 else 0.005 * robust.dark)
    if placement.size <= 1e-4:
        usual = judgements["mitsuba"]
        assert usual.leaks > 0.1 * usual.dark


@pytest.mark.parametrize("light", LIGHTS)
def test_robust_image_does_not_depend_on_the_way_of_tracing(light: str) -> None:
    prepared = prepare(hard_scene(light, Placement(size=1e-3), 40, 1))
    images = set()
    threads = dr.thread_count()
    try:
        for count, traversal in itertools.product(
            (1, 3), ("brute_force", "single", "packet", "adaptive")
        ):
            dr.set_thread_count(count)
            result = prepared.render(shadow_offset="robust", spp=2, traversal=traversal)
            images.add(result.image.tobytes())
    finally:
        dr.set_thread_count(threads)
    assert len(images) == 1


def test_light_far_away_is_like_a_directional_one() -> None:
    """Its rays begin at the surfaces: aimed from there they could not end there."""
    near = hard_scene("directional", Placement(), 64, 2)
    (sun,) = near.emitters
    distance = 1e7
    lamp = type(sun)(
        "point",
        (distance**2,) * 3,
        position=tuple(-distance * component for component in sun.direction),  # type: ignore[arg-type]
    )
    far = type(near)(**{**vars(near), "emitters": (lamp,)})
    images = [prepare(s).render(shadow_offset="robust").image > 0 for s in (near, far)]
    assert 0.1 < images[0].mean() < 0.9
    assert (images[0] != images[1]).sum() <= 3  # directions differ by 1e-6


def test_blocked_segments_of_a_triangle() -> None:
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    inside, outside = [0.25, 0.25], [0.75, 0.75]
    cases = [
        ([*inside, 1], [*inside, -1], -1, True),
        ([*inside, -1], [*inside, 1], -1, True),
        ([*inside, 1], [*inside, -1], 0, False),  # left out
        ([*outside, 1], [*outside, -1], -1, False),
        ([*inside, 2], [*inside, 1], -1, False),  # ends before it
        ([*inside, 0], [*inside, 1], -1, False),  # begins on it
        ([-1, 0.25, 0], [2, 0.25, 0], -1, False),  # in its plane
    ]
    start, target, left_out, expected = zip(*cases, strict=True)
    found = blocked(
        triangle, np.array(start, float), np.array(target, float), np.array(left_out)
    )
    assert found.tolist() == list(expected)
