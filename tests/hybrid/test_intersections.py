"""Images differ from Mitsuba's only where Embree decides in another way what a ray hits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import plugin_scenes
import pytest
import repository
from mlrt_compare.metrics import differing_mask
from mlrt_compare.mitsuba_renderer import MitsubaRenderer
from mlrt_compare.settings import Settings

from mlrt_plugin import prepare
from mlrt_plugin.hybrid import prepared
from mlrt_plugin.hybrid.hit_scene import HitScene

SIZE, SPP, SEED = (96, 72), 4, 5


class Witness(HitScene):
    """Asks Embree the same questions and notes which samples it answers differently."""

    scene: Any
    notes: list[np.ndarray]

    def closest_hit(self, ray: Any, active: Any) -> tuple[Any, Any]:
        pi, face = super().closest_hit(ray, active)
        other = self.scene.ray_intersect_preliminary(ray, True, active)
        both = pi.is_valid() & other.is_valid()
        same = (pi.shape_index == other.shape_index) & (pi.prim_index == other.prim_index)
        # Shapes that are no meshes are numbered among themselves.
        same |= (face < 0) & (pi.t == other.t)
        self.note(active & ((pi.is_valid() != other.is_valid()) | (both & ~same)))
        return pi, face

    def any_hit(self, ray: Any, active: Any) -> Any:
        occluded = super().any_hit(ray, active)
        self.note(active & (occluded != self.scene.ray_test(ray, False, active)))
        return occluded

    def note(self, differs: Any) -> None:
        self.notes.append(
            np.array(differs & dr.full(type(differs), True, dr.width(differs)))
        )


def seen(noted: np.ndarray, reach: int) -> np.ndarray:
    """Pixels that samples reach; `noted`, (H, W, spp), tells of each sample."""
    pixels = np.pad(noted.any(axis=2), reach)
    height, width = noted.shape[:2]
    reached = np.zeros((height, width), bool)
    for y in range(2 * reach + 1):
        for x in range(2 * reach + 1):
            reached |= pixels[y : y + height, x : x + width]
    return reached


OWN = repository.ROOT / "scenes"


@pytest.mark.parametrize(
    "name", ["cornell-box", "office", "instances", "compound materials"]
)
def test_pixels_differ_only_where_hits_do(
    assets: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    path = OWN / name / f"{name}.xml"
    if name in plugin_scenes.SCENES:
        path = assets / "witnessed.xml"
        path.write_text(plugin_scenes.SCENES[name])
    scene = prepare(path, shading="mitsuba", resolution=SIZE)
    whole = mi.load_file(str(path), optimize=False)
    notes: list[np.ndarray] = []
    monkeypatch.setattr(Witness, "scene", whole, raising=False)
    monkeypatch.setattr(Witness, "notes", notes, raising=False)
    monkeypatch.setattr(prepared, "HitScene", Witness)
    image = scene.render(spp=SPP, seed=SEED).image
    lighting = scene.lighting
    reference = MitsubaRenderer(
        Settings(path, spp=SPP, seed=SEED, resolution=SIZE),
        {
            "type": "direct",
            "emitter_samples": lighting.emitter_samples,
            "bsdf_samples": lighting.bsdf_samples,
        },
    )
    reference.frame()
    noted = np.logical_or.reduce(notes).reshape(SIZE[1], SIZE[0], SPP)
    # The filter may carry a sample to the pixel beyond its radius.
    reach = int(np.ceil(scene.loaded.sensor.film().rfilter().radius())) + 1
    differing = differing_mask(image, reference.image)
    assert not np.any(differing & ~seen(noted, reach))
    assert np.mean(noted) < 1e-3
    print(f"{np.count_nonzero(noted)} samples of {noted.size} are decided differently")
