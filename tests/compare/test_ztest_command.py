"""mlrt-compare ztest: references, exit codes, and a sentence for what cannot be tested."""

from __future__ import annotations

import json
import re
from pathlib import Path

import exr_images
import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
import repository
from mlrt_compare.cli import main
from mlrt_compare.scalar_reference import stored_reference
from mlrt_compare.scene_hash import scene_hash
from mlrt_compare.settings import Settings

import mlrt_llvm

SCENE = repository.ROOT / "scenes" / "cornell-box" / "cornell-box.xml"
SMALL = ("--resolution", "24x24", "--spp", "64", "--reference-spp", "512")
SEED = 20_260_810


def run(*arguments: object) -> int:
    return main(["ztest", *map(str, arguments)])


def test_reference_is_rendered_once_and_kept(tmp_path: Path) -> None:
    figures, cache, maps = tmp_path / "z.json", tmp_path / "cache", tmp_path / "maps"
    assert run(SCENE, *SMALL, "--cache", cache, "--json", figures, "-o", maps) == 0
    (told,) = json.loads(figures.read_text())
    assert (told["code"], told["spp"], told["reference_spp"]) == (0, 64, 512)
    assert told["pixels_pass"] and told["alpha"] == pytest.approx(1 - 0.99 ** (1 / 576))
    (kept,) = cache.iterdir()
    assert [path.name for path in maps.iterdir()] == ["cornell-box-p.png"]
    # What is kept decides: a reference that is too bright fails the same image.
    with np.load(kept) as arrays:
        wrong = {"mean": 1.5 * arrays["mean"], "variance": arrays["variance"]}
    np.savez(kept, **wrong)
    assert run(SCENE, *SMALL, "--cache", cache) == 2
    kept.write_bytes(b"damaged")
    assert run(SCENE, *SMALL, "--cache", cache) == 0


def test_each_path_of_a_folder(tmp_path: Path) -> None:
    """With a table; what is no scene is told of and not counted."""
    try:
        mlrt_llvm.activate()
    except mlrt_llvm.LlvmUnavailable as error:
        pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}")
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "box.xml").write_text(SCENE.read_text())
    (folder / "part.xml").write_text('<scene version="3.0.0"/>')
    table, figures = tmp_path / "z.md", tmp_path / "z.json"
    options = (*SMALL, "--cache", tmp_path / "cache", "--each-path")
    assert run(folder, *options, "--table", table, "--json", figures) == 0
    rows = json.loads(figures.read_text())
    assert [row.get("path") for row in rows] == ["native", "mitsuba", None]
    # Both take the same samples, so that one reference does for both.
    assert len(list((tmp_path / "cache").iterdir())) == 1
    assert all(row["pixels_pass"] for row in rows[:2])
    text = table.read_text()
    assert text.count("| pass |") == 2 and "- part.xml: scene" in text
    assert run(folder / "part.xml", *options) == 4


def test_stored_reference_of_mitsubas_tests_goes_before(
    tmp_path: Path, scalar_variant: None
) -> None:
    scene = tmp_path / "box_direct.xml"
    scene.write_text(
        SCENE.read_text().replace('name="res" value="512"', 'name="res" value="24"')
    )
    refs = tmp_path / "refs"
    refs.mkdir()
    loaded = mi.load_file(str(scene))
    moment = mi.load_dict({"type": "moment", "nested": loaded.integrator()})
    values = np.array(mi.render(loaded, integrator=moment, spp=2048))
    variance = np.maximum(values[..., 6:] - values[..., 3:6] ** 2, 0)
    for name, xyz in (("box_ref_rgb", values[..., 3:6]), ("box_ref_rgb_var", variance)):
        bitmap = mi.Bitmap(np.ascontiguousarray(xyz), mi.Bitmap.PixelFormat.XYZ)
        rgb = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
        rgb.write(str(refs / f"{name}.exr"))
    found = stored_reference(scene)
    assert found is not None
    np.testing.assert_allclose(found.mean, values[..., 3:6], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(found.variance, variance, rtol=1e-3, atol=1e-5)
    figures = tmp_path / "z.json"
    options = ("--cache", tmp_path / "cache", "--json", figures)
    assert run(scene, *options, "--spp", 32) == 0
    (told,) = json.loads(figures.read_text())
    assert told["reference"].endswith("box_ref_rgb.exr")
    assert told["reference_spp"] is None and not list((tmp_path / "cache").iterdir())


def test_reference_by_the_authored_integrator(tmp_path: Path) -> None:
    """Where both find the same light, which the sampling of a path does."""
    scene = tmp_path / "scene.xml"
    authored = '<integrator type="path"><integer name="max_depth" value="2"/></integrator>'
    text, count = re.subn(
        "<integrator.*</integrator>", authored, SCENE.read_text(), flags=re.DOTALL
    )
    assert count == 1
    scene.write_text(text)
    cache = tmp_path / "cache"
    assert run(scene, *SMALL, "--cache", cache) == 0
    (path,) = cache.iterdir()
    with np.load(path) as arrays:
        mean, variance = arrays["mean"], arrays["variance"]
    assert run(scene, *SMALL, "--cache", cache, "--authored") in (0, 2)
    (other,) = set(cache.iterdir()) - {path}
    with np.load(other) as arrays:
        assert arrays["mean"].mean() == pytest.approx(mean.mean(), rel=0.02)
        assert arrays["variance"].mean() == pytest.approx(variance.mean(), rel=0.2)
        assert not np.array_equal(arrays["mean"], mean)


def test_filters_that_share_samples_are_warned_of(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = (*SMALL, "--cache", tmp_path / "cache")
    run(SCENE, *options)
    assert "filter" not in capsys.readouterr().err
    run(SCENE, *options, "-D", "rfilter=gaussian")
    assert "the film's filter gaussian" in capsys.readouterr().err


def test_files_are_tested_with_the_samples_told(tmp_path: Path) -> None:
    expected = exr_images.picture(SEED)
    files = [exr_images.write_exr(tmp_path / "image.exr", expected + 0.05)]
    files += [exr_images.write_exr(tmp_path / "reference.exr", expected)]
    files += [exr_images.write_exr(tmp_path / "var.exr", np.full_like(expected, 0.01))]
    # Half a standard deviation of a sample: nothing for one, 5 deviations for 100.
    assert run(*files, "--spp", 1) == 0
    assert run(*files, "--spp", 100) == 2


def test_a_variance_without_colour_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image = exr_images.write_exr(tmp_path / "image.exr", exr_images.picture(SEED))
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    gray = {"Y": np.ones((48, 64), np.float32)}
    OpenEXR.File(header, gray).write(str(tmp_path / "var.exr"))
    assert run(image, image, tmp_path / "var.exr", "--spp", 1) == 4
    assert "var.exr lacks the channels R, G, B" in capsys.readouterr().err


def test_maps_of_scenes_with_the_same_name_are_kept_apart(tmp_path: Path) -> None:
    copy = tmp_path / SCENE.name
    copy.write_text(SCENE.read_text())
    options = (*SMALL, "--cache", tmp_path / "cache", "-o", tmp_path / "maps")
    assert run(SCENE, copy, *options) == 0
    names = sorted(path.name for path in (tmp_path / "maps").iterdir())
    assert names == ["cornell-box-2-p.png", "cornell-box-p.png"]


def test_one_that_cannot_be_tested_does_not_stop_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = (*SMALL, "--cache", tmp_path / "cache")
    assert run(tmp_path / "none.xml", SCENE, *options) == 4
    captured = capsys.readouterr()
    assert "none.xml" in captured.err and "PASS" in captured.out


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "SCENE|FOLDER|IMAGE"),
        (("a.exr", "b.exr"), "three EXR files"),
        (("a.exr", "b.exr", "c.exr"), "--spp N"),
        (("a.exr", "b.exr", "c.exr", "--spp", "1"), "a.exr does not exist"),
        ((SCENE, "--cache", SCENE), "--cache"),
        ((SCENE, "--spp", "0"), "0 is less than 1"),
    ],
)
def test_what_cannot_run_is_one_sentence(
    capsys: pytest.CaptureFixture[str], arguments: tuple[object, ...], said: str
) -> None:
    assert run(*arguments) == 4
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and said in lines[0]


def test_hash_tells_all_that_the_image_depends_on(tmp_path: Path) -> None:
    text = SCENE.read_text()
    copy = tmp_path / "copy.xml"
    copy.write_text(text)
    usual = scene_hash(Settings(SCENE))
    assert scene_hash(Settings(copy)) == usual, "the same scene elsewhere"
    assert scene_hash(Settings(SCENE, spp=3, seed=4, threads=1)) == usual
    others = {
        usual,
        scene_hash(Settings(SCENE, resolution=(32, 32))),
        scene_hash(Settings(SCENE, defines={"rfilter": "gaussian"})),
    }
    copy.write_text(text.replace('origin="278, 273, -800"', 'origin="278, 273, -800.0001"'))
    others.add(scene_hash(Settings(copy)))
    copy.write_text(
        text.replace('value="0.73, 0.72, 0.69"', 'value="0.73, 0.72, 0.6900001"')
    )
    others.add(scene_hash(Settings(copy)))
    assert len(others) == 5


def test_hash_tells_the_files_of_the_scene(tmp_path: Path) -> None:
    mesh = tmp_path / "mesh.obj"
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<scene version="3.0.0"><shape type="obj">'
        '<string name="filename" value="mesh.obj"/></shape></scene>'
    )
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    before = scene_hash(Settings(scene))
    mesh.write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    assert scene_hash(Settings(scene)) != before
