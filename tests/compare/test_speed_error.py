"""mlrt-compare speed-error: figures of a small run, and what it refuses to call faster."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import repository
from compare_command import BENT, python
from mlrt_compare.cli import main
from PIL import Image as Pillow

SCENE = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"
SMALL = ("--resolution", "48x48", "--spp", "1,2,4,8", "--rounds", "6")


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("references")


def test_a_small_run(tmp_path: Path, cache: Path) -> None:
    child = python(
        *("-m", "mlrt_compare", "speed-error", SCENE, *SMALL, "--least-seconds", "0.005"),
        *("--cache", cache, "-o", tmp_path / "out"),
    )
    assert child.returncode == 0, child.stdout + child.stderr
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == [f"cornell-box-speed-error.{kind}" for kind in ("json", "md", "png")]
    told = json.loads((tmp_path / "out" / names[0]).read_text())
    assert told["passed"] and told["reference"]["spp"] == 8 * 64
    mlrt, mitsuba = told["sides"]
    for side in (mlrt, mitsuba):
        assert [point["spp"] for point in side["points"]] == [1, 2, 4, 8]
        for point in side["points"]:
            assert len(point["seconds"]) == len(point["mse_runs"]) == 6
            assert point["first"] > 0 and point["median"] > 0
        # Frames of so few pixels are not measured one by one.
        assert side["points"][0]["frames"] > 1
    # The same random numbers: the same error, run by run.
    for ours, theirs in zip(mlrt["points"], mitsuba["points"], strict=True):
        assert ours["mse_runs"] == pytest.approx(theirs["mse_runs"], rel=0.02)
    assert -1.2 < mlrt["slope"]["value"] < -0.8
    assert mlrt["points"][0]["jit"] is None and mitsuba["points"][0]["jit"] is not None
    assert told["machine"]["processor"] and told["machine"]["llvm"]
    text = (tmp_path / "out" / names[1]).read_text()
    assert text in child.stdout and "**PASS**" in text
    assert f"({mlrt['points'][0]['frames']} at 1 spp, " in text
    with Pillow.open(tmp_path / "out" / names[2]) as picture:
        assert picture.size[0] > 600


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("image * 0.97", "the means differ by"),
        ("image + 0.5", "falls with samples to the power of"),
        ("image[..., ::-1]", "so the estimators are not the same"),
    ],
)
def test_a_wrong_image_is_no_speed_up(tmp_path: Path, how: str, said: str) -> None:
    child = python(
        *("-c", BENT.format(how=how), "speed-error", SCENE, *SMALL),
        *("--least-seconds", "0"),
        *("--cache", tmp_path / "cache", "-o", tmp_path),
    )
    assert child.returncode == 2, child.stdout + child.stderr
    assert "**FAIL: " in child.stdout and said in child.stdout


COINCIDENT = """<scene version="3.0.0">
    <integrator type="direct">
        <integer name="emitter_samples" value="1"/>
        <integer name="bsdf_samples" value="0"/>
    </integrator>
    <default name="spp" value="1"/> <default name="resx" value="48"/>
    <default name="resy" value="48"/>
    <sensor type="perspective">
        <float name="fov" value="60"/>
        <transform name="to_world">
            <lookat origin="0.3, -0.7, 3.1" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm">
            <integer name="width" value="$resx"/> <integer name="height" value="$resy"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <emitter type="point">
        <point name="position" x="1" y="2" z="4"/> <rgb name="intensity" value="30"/>
    </emitter>
    <emitter type="point">
        <point name="position" x="-1" y="0" z="2"/> <rgb name="intensity" value="9"/>
    </emitter>
    <shape type="rectangle">
        <transform name="to_world"><scale value="3"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
    </shape>
    <shape type="rectangle">
        <transform name="to_world">
            <scale value="0.3"/> <rotate z="1" angle="20"/> <translate x="0.9" y="0.8"/>
        </transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf>
    </shape>
</scene>
"""


def test_faces_in_the_same_plane_stand_apart(tmp_path: Path, cache: Path) -> None:
    """Of two faces that are equally near, MLRT takes the first, Embree the one whose
    distance happens to be rounded down."""
    scene = tmp_path / "coincident.xml"
    scene.write_text(COINCIDENT)
    child = python(
        *("-m", "mlrt_compare", "speed-error", scene, "--spp", "1,2,4", "--rounds", "4"),
        *(
            "--least-seconds",
            "0",
            "--reference-factor",
            "256",
            "--cache",
            cache,
            "-o",
            tmp_path / "out",
        ),
    )
    told = json.loads((tmp_path / "out" / "coincident-speed-error.json").read_text())
    assert not told["bias"]["passed"], child.stdout
    disputed = told["disputed_tiles"]
    assert disputed["reasons"] == [] and 1 <= disputed["tiles"] <= 4
    assert disputed["others"]["tiles"] + disputed["others"]["quiet_tiles"] >= 5
    judged = disputed["judgement"]
    assert judged["rays"] == judged["both_right"] > 100
    assert f"Without the {disputed['tiles']} tiles of such rays, the others" in child.stdout
    assert not {*told["bias"]["reasons"]} & {*told["reasons"]}


def test_a_missing_scene_is_one_sentence(tmp_path: Path) -> None:
    child = python("-m", "mlrt_compare", "speed-error", "none.xml", "-o", tmp_path)
    lines = child.stderr.splitlines()
    assert child.returncode == 4 and len(lines) == 1 and "none.xml" in lines[0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "SCENE"),
        ((SCENE, "--spp", "1,0"), "0 is less than 1"),
        ((SCENE, "--spp", "many"), "'many' is not a whole number"),
        ((SCENE, "--rounds", "3"), "3 is less than 4"),
        ((SCENE, "--least-seconds", "nan"), "nan is not from 0 to 60 seconds"),
        ((SCENE, "--least-seconds", "long"), "'long' is not a number"),
        ((SCENE, "-o", SCENE), "not a folder"),
        ((SCENE, "--cache", SCENE), "--cache"),
    ],
)
def test_what_cannot_run_is_one_sentence(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[object, ...],
    said: str,
) -> None:
    output = () if "-o" in arguments else ("-o", tmp_path / "output")
    assert main(["speed-error", *map(str, (*arguments, *output))]) == 4
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and said in lines[0]
    assert not list(tmp_path.iterdir())
