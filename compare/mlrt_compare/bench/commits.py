"""The sources of another commit of a checkout."""

from __future__ import annotations

import io
import subprocess
import tarfile
import tempfile
from pathlib import Path

from .checkout import is_checkout
from .errors import BenchError
from .native import SOURCE_FOLDERS


def commit_named(source: Path, name: str) -> str:
    """The full name of a commit that git knows by ``name``; raises BenchError if there is
    none."""
    try:
        found = git(
            source, "rev-parse", "--verify", "--end-of-options", f"{name}^{{commit}}"
        )
    except BenchError as error:
        raise BenchError(
            f"{source} has no commit '{name}': name one of `git log`"
        ) from error
    return found.decode().strip()


def sources_of(source: Path, commit: str, cache: Path) -> Path:
    """A folder with what the native side of that commit is compiled from, which stays in
    the cache.

    commit: its full name. Raises BenchError if it is not there, or has no benchmarks.
    """
    folder = cache / "commits" / commit
    if not folder.is_dir():
        try:
            archive = git(source, "archive", "--format=tar", commit, "--", *SOURCE_FOLDERS)
        except BenchError as error:
            raise BenchError(
                f"commit {commit[:10]} has no {' and '.join(SOURCE_FOLDERS)} to compile: "
                "name a later one"
            ) from error
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".commit-") as temporary:
            unpacked = Path(temporary) / "sources"
            with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
                tar.extractall(unpacked, filter="data")
            if not folder.is_dir():
                unpacked.rename(folder)
    if not is_checkout(folder):
        raise BenchError(f"commit {commit[:10]} has no benchmarks: name a later one")
    return folder


def git(source: Path, *arguments: str) -> bytes:
    """What git prints; raises BenchError with its first line if it refuses."""
    try:
        return subprocess.run(
            ["git", "-C", str(source), *arguments], capture_output=True, check=True
        ).stdout
    except OSError as error:
        raise BenchError(f"git cannot be run ({error.strerror}): install it") from error
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode(errors="replace").strip() or "no message"
        raise BenchError(f"git: {said.splitlines()[0]}") from error
