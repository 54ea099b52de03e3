"""Image files: what they hold, and that they are whole or absent."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from pipes_read import reader_of

from mlrt_plugin import OutputError
from mlrt_plugin.image_files import check_output, write_image

IMAGE = np.linspace(0, 2, 5 * 7 * 3, dtype=np.float32).reshape(5, 7, 3)


def channel(path: Path, name: str) -> np.ndarray:
    """A channel as Mitsuba reads it."""
    planes = dict(mi.Bitmap(str(path)).split())
    group, _, letter = name.rpartition(".")
    bitmap = planes[group or "<root>"]
    names = [field.name for field in bitmap.struct_()]
    index = [n.rpartition(".")[2] for n in names].index(letter)
    return np.array(bitmap).reshape(*np.array(bitmap).shape[:2], -1)[..., index]


def test_exr_is_exact(tmp_path: Path) -> None:
    path = tmp_path / "image.exr"
    write_image(path, IMAGE)
    read = np.array(mi.Bitmap(str(path)))
    assert read.dtype == np.float32
    np.testing.assert_array_equal(read, IMAGE)


def test_exr_with_aovs(tmp_path: Path) -> None:
    path = tmp_path / "image.exr"
    depth = np.arange(35, dtype=np.float32).reshape(5, 7)
    prim = np.arange(35, dtype=np.int32).reshape(5, 7) - 1
    write_image(path, IMAGE, {"depth": depth, "normal": -IMAGE, "prim": prim})
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        assert sorted(channels) == sorted(
            ["R", "G", "B", "depth.T", "normal.X", "normal.Y", "normal.Z", "prim.I"]
        )
        np.testing.assert_array_equal(channels["depth.T"].pixels, depth)
        np.testing.assert_array_equal(channels["prim.I"].pixels, prim)
        np.testing.assert_array_equal(channels["normal.Y"].pixels, -IMAGE[..., 1])
    np.testing.assert_array_equal(channel(path, "depth.T"), depth)
    np.testing.assert_array_equal(channel(path, "G"), IMAGE[..., 1])


def test_png_is_srgb(tmp_path: Path) -> None:
    path = tmp_path / "image.png"
    write_image(path, IMAGE)
    linear = np.clip(IMAGE.astype(np.float64), 0, 1)
    srgb = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055
    )
    # Mitsuba dithers, so a value may be rounded either way.
    np.testing.assert_allclose(np.array(mi.Bitmap(str(path))), 255 * srgb, atol=1)


@pytest.mark.parametrize(
    ("name", "aovs", "expected"),
    [
        ("image.jpg", (), "no known format"),
        ("image", (), "no known format"),
        ("absent/image.exr", (), "there is no folder .*absent: create"),
        ("image.png", ("depth",), "cannot hold AOVs"),
        ("folder.exr", (), "is a folder"),
    ],
)
def test_refused_before_work(
    tmp_path: Path, name: str, aovs: tuple[str, ...], expected: str
) -> None:
    (tmp_path / "folder.exr").mkdir()
    with pytest.raises(OutputError, match=expected):
        check_output(tmp_path / name, aovs)


def test_a_pipe_gets_the_image(tmp_path: Path) -> None:
    for name in ("image.exr", "image.png"):
        file, pipe = tmp_path / name, tmp_path / f"pipe-{name}"
        write_image(file, IMAGE)
        with reader_of(pipe) as told:
            check_output(pipe)
            write_image(pipe, IMAGE)
            assert told() == file.read_bytes()
        assert pipe.is_fifo()


@pytest.mark.parametrize("error", [RuntimeError("disk\nfull"), KeyboardInterrupt()])
def test_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    path = tmp_path / "image.exr"
    path.write_bytes(b"before")

    def fail(self: object, name: str) -> None:
        Path(name).write_bytes(b"half")
        raise error

    monkeypatch.setattr(OpenEXR.File, "write", fail)
    expected = OutputError if isinstance(error, RuntimeError) else KeyboardInterrupt
    with pytest.raises(expected):
        write_image(path, IMAGE)
    assert path.read_bytes() == b"before"
    assert [p.name for p in tmp_path.iterdir()] == ["image.exr"]
