"""Where the elements of a scene are, as Mitsuba's parser tells it."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import scene_files

from mlrt_plugin.parsing import parse_file


def test_places_are_those_of_mitsuba(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(
        '<scene version="3.0.0">\r\n\r\n\t<shape type="cube"/><shape type="disk"/>\n'
        "</scene>"
    )
    path = tmp_path / "scene.xml"
    include = '<include filename="part.xml"/>'
    accents = '<bsdf type="diffuse" id="cr\u00e8me"/><bsdf type="diffuse" id="b"/>'
    path.write_text(scene_files.scene_xml(extra=include + accents), encoding="utf-8")
    parsed = parse_file(path, {})
    expected = [
        mi.parser.file_location(parsed.state, node)
        .replace(" (line ", " line ")
        .replace(", col ", ":")
        .rstrip(")")
        for node in parsed.state.nodes
    ]
    assert [element.where for element in parsed.elements] == expected
    assert len(set(expected)) == len(expected) > 10
