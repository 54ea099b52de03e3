"""mlrt-bench features: scenes differ in one feature each, and not in their pictures."""

from __future__ import annotations

from pathlib import Path

import pytest
import repository
import scene_files
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.features import (
    FEATURES,
    PLAIN,
    FeatureTimes,
    below_all,
    measure_features,
    prepared_with,
    rows_of,
)

from mlrt_plugin.render import PreparedScene
from mlrt_plugin.shape_arrays import NONE

BOX = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"


def test_pictures_are_the_same() -> None:
    times = measure_features(BOX, 32, 1, 2)
    assert [each.feature for each in times] == list(FEATURES)
    assert all(each.differing == 0 and len(each.seconds) == 2 for each in times)


def test_each_scene_has_its_feature_and_no_other(tmp_path: Path) -> None:
    cube = below_all(BOX)

    def features(content: str) -> set[str]:
        scene = prepared_with(BOX, content, 8, tmp_path, cube)
        assert isinstance(scene, PreparedScene)
        assert scene.report["wide_bytes"] > 0  # which no frame is to make
        small, numbers = scene.arrays.shapes[-1], scene.arrays.material_textures
        assert numbers is not None and small.face_count == 12
        front, _, opacity = numbers[small.material]
        return {
            name
            for name, present in {
                "alpha": opacity != NONE,
                "textures": front != NONE,
                "vertex normals": small.vertex_normals,
                "an area light": small.emitter != NONE,
            }.items()
            if present
        }

    for name, content in FEATURES.items():
        assert features(content) == ({name} - {PLAIN})


def test_figures_are_ratios_within_rounds() -> None:
    plain = FeatureTimes(PLAIN, [1.0, 2.0, 4.0], True)
    other = FeatureTimes("textures", [1.5, 2.0, 8.0], True)
    rows = rows_of([plain, other])
    assert rows[0]["ratio"] == 1 and rows[0]["quartiles"] == [1, 1]
    assert rows[1]["ratio"] == 1.5 and rows[1]["quartiles"] == [1.25, 1.75]


def test_scenes_that_mitsuba_shades_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    metal = '<shape type="cube"><bsdf type="roughconductor"/></shape>'
    path.write_text(scene_files.scene_xml(shapes=metal))
    with pytest.raises(BenchError, match=r"not shaded natively.*roughconductor"):
        measure_features(path, 8, 1, 1)
