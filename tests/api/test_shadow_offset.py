"""The option shadow_offset: where it can be given, and what goes first."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
import scene_files

from mlrt_plugin import MlrtError, UnsupportedFeature, prepare, render
from mlrt_plugin._dispatch import core
from mlrt_plugin.cli import main

SceneFile = Callable[..., Path]

# A cover so close to the lamp, at 1, 2, 3, that Mitsuba's shadow rays end behind it.
COVER = """<shape type="rectangle" id="cover"><transform name="to_world">
    <scale value="0.5"/><translate x="1" y="2" z="2.999"/></transform></shape>"""
OWN = '<integrator type="mlrt"><string name="shadow_offset" value="robust"/></integrator>'


def test_ways_of_choosing(
    scene_file: SceneFile, tmp_path: Path, scalar_variant: None
) -> None:
    shapes = scene_files.FLOOR + COVER
    plain = scene_file("plain.xml", shapes=shapes)
    own = scene_file("own.xml", shapes=shapes, integrator=OWN)
    usual, robust = (render(plain, shadow_offset=s).image for s in ("mitsuba", "robust"))
    assert usual.max() > 0
    assert robust.max() == 0
    np.testing.assert_array_equal(render(plain).image, usual)
    np.testing.assert_array_equal(render(own).image, robust)
    np.testing.assert_array_equal(render(own, shadow_offset="mitsuba").image, usual)
    np.testing.assert_array_equal(prepare(own).render().image, robust)
    scene = mi.load_file(str(plain), optimize=False)
    integrator = mi.load_dict({"type": "mlrt", "shadow_offset": "robust"})
    np.testing.assert_array_equal(np.array(mi.render(scene, integrator=integrator)), robust)
    output = tmp_path / "robust.exr"
    flags = ["-o", str(output), "--shadow-offset", "robust"]
    assert main(["render", str(plain), *flags]) == 0
    np.testing.assert_array_equal(np.array(mi.Bitmap(str(output))), robust)


def test_other_values_are_refused(
    scene_file: SceneFile, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scene_file()
    with pytest.raises(MlrtError, match="'none' does not exist: choose from mitsuba, rob"):
        render(path, shadow_offset="none")
    with pytest.raises(MlrtError, match="shadow_offset '3' does not exist"):
        prepare(path).render(shadow_offset=3)  # type: ignore[arg-type]
    with pytest.raises(MlrtError, match="shadow_offset 'none'"):
        render(scene_file("other.xml", integrator=OWN.replace("robust", "none")))
    with pytest.raises(ValueError, match="must be 'mitsuba' or 'robust', not 'none'"):
        core.render(prepare(path).handle, 1, shadow_offset="none")
    with pytest.raises(SystemExit):
        main(["render", str(path), "--shadow-offset", "none"])
    assert "choose from" in capsys.readouterr().err
    with pytest.raises(UnsupportedFeature, match="no parameter 'shadow_offsets'"):
        render(
            scene_file(
                "names.xml", integrator=OWN.replace("shadow_offset", "shadow_offsets")
            )
        )
