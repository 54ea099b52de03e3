"""Scenes of mlrt-bench: where they come from, and where their light is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import repository
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.scenes import GeneratedScene, chosen_scenes, imported, usual_scenes

DRAGON = repository.ROOT / "scenes" / "dragon"


def test_usual_scenes_are_those_of_the_published_table() -> None:
    names = [scene.name for scene in chosen_scenes(None, usual_scenes(repository.ROOT))]
    assert names == ["office", "conference", "building", "dragon-2.2M", "dragon-7.2M"]
    chosen = chosen_scenes(["dragon-7.2M", "some/room.xml"], usual_scenes(repository.ROOT))
    assert [scene.name for scene in chosen] == ["dragon-7.2M", "room"]


def test_unknown_scene_is_refused_by_name() -> None:
    with pytest.raises(BenchError, match="no scene 'bunny': choose from office, conf"):
        chosen_scenes(["office", "bunny"], usual_scenes(repository.ROOT))


def test_missing_scene_says_what_to_do(tmp_path: Path) -> None:
    checkout = tmp_path / "mlrt"
    conference = chosen_scenes(["conference"], usual_scenes(checkout))[0]
    with pytest.raises(BenchError, match=r"no .*conference\.xml: put the conference room"):
        conference.load(tmp_path)


def test_generated_scene_is_generated_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = GeneratedScene("small", DRAGON, 2000)
    first = scene.load(tmp_path)
    assert 1500 < len(first.faces) < 2500
    assert first.faces.max() < len(first.vertices)
    files = [path.name for path in (tmp_path / "scenes").iterdir()]
    assert files == [f"small-{scene.key()}.npz"]

    def never(*_: object) -> None:
        raise AssertionError("it was generated again")

    monkeypatch.setattr(GeneratedScene, "generated", never)
    again = scene.load(tmp_path)
    assert np.array_equal(again.vertices, first.vertices)
    assert np.array_equal(again.faces, first.faces)
    assert again.view.keys() == first.view.keys()
    assert all(np.array_equal(again.view[key], first.view[key]) for key in first.view)


def test_key_depends_on_what_is_asked_for() -> None:
    keys = [
        GeneratedScene("a", DRAGON, 2000).key(),
        GeneratedScene("a", DRAGON, 3000).key(),
        GeneratedScene("a", DRAGON, 2000, seed=2).key(),
        GeneratedScene("a", DRAGON.parent / "building", 2000).key(),
    ]
    assert len(set(keys)) == 4


def test_generator_that_fails_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(BenchError, match=r"scene small cannot be generated: .*triangles"):
        GeneratedScene("small", DRAGON, 3).load(tmp_path)
    assert list((tmp_path / "scenes").iterdir()) == []


POINT = '<emitter type="point"><point name="position" x="1" y="2" z="3"/></emitter>'
AREA = """
<shape type="rectangle">
    <transform name="to_world">
        <scale x="2" y="3"/><translate x="4" y="5" z="6"/>
    </transform>
    <emitter type="area"/>
</shape>"""
SUN = '<emitter type="directional"><vector name="direction" x="0" y="0" z="-1"/></emitter>'


@pytest.mark.parametrize(
    ("lights", "place"), [(AREA + POINT, (1, 2, 3)), (SUN + AREA, (4, 5, 6))]
)
def test_light_is_at_the_first_point_or_in_the_middle_of_a_shape(
    scene_file: Callable[..., Path], lights: str, place: tuple[float, ...]
) -> None:
    scene = imported("scene", scene_file(emitters=lights))
    assert scene.view["light"] == pytest.approx(place)


def test_scene_without_a_place_of_light_is_refused(
    scene_file: Callable[..., Path],
) -> None:
    with pytest.raises(BenchError, match="add a point light"):
        imported("scene", scene_file(emitters=SUN))


def test_malformed_scene_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "broken.xml"
    path.write_text('<scene version="3.0.0"><shape type="cube"></scene>')
    with pytest.raises(BenchError, match=r"scene broken cannot be read: .*broken\.xml"):
        imported("broken", path)
