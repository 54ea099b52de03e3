"""Files come whole or not at all; pipes, devices and links stay what they are."""

from __future__ import annotations

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from pipes_read import reader_of

from mlrt_files import obstacle, put_in_place, replacing

TEXT = "all of it\n" * 20_000
"""More than a pipe holds."""

WRITER = """
import sys
from pathlib import Path
from mlrt_files import obstacle, replacing
path = Path(sys.argv[1])
print("before")
assert obstacle(path) is None, obstacle(path)
with replacing(path) as temporary:
    temporary.write_text("written\\n")
print("after")
"""


def write(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        assert temporary.suffix == path.suffix
        temporary.write_text(text)


def test_a_pipe_gets_all_and_stays(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    with reader_of(pipe) as told:
        assert obstacle(pipe) is None
        write(pipe, TEXT)
        assert told() == TEXT.encode()
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_link_to_a_pipe(tmp_path: Path) -> None:
    pipe, link, made = tmp_path / "pipe", tmp_path / "link.exr", tmp_path / "made"
    link.symlink_to(pipe)
    made.write_text(TEXT)
    with reader_of(pipe) as told:
        assert put_in_place(made, link) == link
        assert told() == TEXT.encode()
    assert link.is_symlink()
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert sorted(tmp_path.iterdir()) == [link, pipe]


def test_nothing_goes_to_a_pipe_if_the_work_fails(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    with reader_of(pipe) as told:
        with pytest.raises(ZeroDivisionError), replacing(pipe) as temporary:
            temporary.write_text("half")
            raise ZeroDivisionError
        pipe.open("w").close()
        assert told() == b""


@pytest.mark.parametrize("name", ["/dev/fd/1", "/proc/self/fd/1", "link"])
@pytest.mark.parametrize("to_file", [False, True], ids=["pipe", "file"])
def test_an_open_descriptor(tmp_path: Path, name: str, to_file: bool) -> None:
    """Comes in the order of what is printed, and does not overwrite it."""
    path, file = tmp_path / name, tmp_path / "output"
    if name == "link":
        path.symlink_to("/dev/stdout")
    command = [sys.executable, "-c", WRITER, str(path)]
    if to_file:
        with file.open("w") as output:
            subprocess.run(command, check=True, stdout=output, timeout=60)
        said = file.read_text()
    else:
        said = subprocess.run(
            command, check=True, capture_output=True, text=True, timeout=60
        ).stdout
    assert said == "before\nwritten\nafter\n"


def test_descriptors_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with (tmp_path / "file").open() as file:
        assert obstacle(Path(f"/dev/fd/{file.fileno()}")) == "it is open to be read"
    assert obstacle(Path("/dev/fd/98765")) == os.strerror(errno.EBADF)


def test_links_are_written_through(tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    target, link = folder / "target", tmp_path / "link.json"
    link.symlink_to("folder/target")
    for text in ("made", "replaced"):
        assert obstacle(link) is None
        write(link, text)
        assert link.is_symlink()
        assert target.read_text() == text
    assert list(folder.iterdir()) == [target]


def test_moving_over_a_link(tmp_path: Path) -> None:
    target, link, made = tmp_path / "target", tmp_path / "link", tmp_path / "made"
    target.write_text("old")
    link.symlink_to(target)
    made.write_text("new")
    put_in_place(made, link)
    assert target.read_text() == "new"
    assert sorted(tmp_path.iterdir()) == [link, target]


def test_a_name_as_long_as_can_be(tmp_path: Path) -> None:
    path = tmp_path / ("ä" * 125 + ".json")
    write(path, "text")
    assert path.read_text() == "text"


def test_obstacles(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (tmp_path / "round").symlink_to("round")
    (tmp_path / "astray").symlink_to("absent/file")
    for name, expected in {
        "absent/file": f"there is no folder {tmp_path / 'absent'}: create it first",
        "astray": f"there is no folder {tmp_path.resolve() / 'absent'}: create it first",
        "file/file": f"there is no folder {tmp_path / 'file'}: create it first",
        ".": "it is a folder: name a file",
        "round": os.strerror(errno.ELOOP),
        "x" * 300: os.strerror(errno.ENAMETOOLONG),
    }.items():
        assert obstacle(tmp_path / name) == expected
    for name in ("file", "new"):
        assert obstacle(tmp_path / name) is None


def test_permissions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Root may write everywhere, so that the system's answer is made up."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    assert obstacle(pipe) == "there is no permission to write to it"
    reason = obstacle(tmp_path / "file")
    assert reason is not None
    assert f"no permission to write to the folder {tmp_path.resolve()}" in reason
