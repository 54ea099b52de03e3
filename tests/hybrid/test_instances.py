"""Instances of meshes are written out, and seen as Mitsuba sees instances."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import plugin_scenes as parts
import pytest

from mlrt_plugin import UnsupportedFeature, prepare, render
from mlrt_plugin.hybrid import instances

CUBE = '<shape type="cube"/>'
TURNS = {
    "turned": '<scale value="0.4"/><rotate y="1" angle="30"/>',
    "mirrored": '<scale x="-0.4" y="0.4" z="0.4"/><rotate y="1" angle="30"/>',
    "stretched": '<scale x="0.4" y="0.7" z="0.2"/><rotate x="1" angle="30"/>',
    "about a long axis": '<scale value="0.4"/><rotate x="1" y="2" angle="50"/>',
}


def write(path: Path, group: str, *turns: str) -> Path:
    copies = "".join(
        f'<shape type="instance"><ref id="group"/><transform name="to_world">{turn}'
        f'<translate x="{1.1 * i - 0.5}" y="0.6"/></transform></shape>'
        for i, turn in enumerate(turns)
    )
    path.write_text(
        parts.scene(f'<shape type="shapegroup" id="group">{group}</shape>{copies}')
    )
    return path


@pytest.mark.parametrize("name", TURNS)
def test_copies_look_like_instances(assets: Path, name: str) -> None:
    metal = parts.bsdf(
        "roughconductor", parts.number("alpha_u", 0.1) + parts.number("alpha_v", 0.5)
    )
    group = f'<shape type="cube">{metal}</shape>'
    path = write(assets / "copies.xml", group, TURNS[name])
    image = render(path, seed=8).image
    expected = np.array(mi.render(mi.load_file(str(path), optimize=False), seed=8))
    differing = np.abs(image - expected).max(axis=-1) > 1e-3 * expected.max()
    assert np.count_nonzero(differing) <= 2 and image.max() > 0


def test_copies_are_in_the_tree(assets: Path) -> None:
    path = write(assets / "tree.xml", CUBE * 2, *TURNS.values())
    report = prepare(path, shading="mitsuba").report
    # The floor, the panel, and all copies of either cube.
    assert report["tree_shapes"] == 4 and report["mitsuba_shapes"] == 0
    assert report["triangles"] == 4 + 2 * 12 * len(TURNS)


def test_groups_of_other_shapes_stay(assets: Path) -> None:
    path = write(assets / "stay.xml", CUBE + '<shape type="sphere"/>', TURNS["turned"])
    assert prepare(path, shading="mitsuba").report["mitsuba_shapes"] == 1


def test_too_many_faces_are_refused(assets: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(assets / "faces.xml", CUBE, *TURNS.values())
    monkeypatch.setattr(instances, "LARGEST_FACE_COUNT", 40)
    with pytest.raises(UnsupportedFeature, match="4 instances with 48 faces in all"):
        prepare(path, shading="mitsuba")
