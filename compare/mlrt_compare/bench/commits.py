"""The sources of another commit of a checkout."""

from __future__ import annotations

import io
import shutil
import subprocess
import tempfile
import zipfile
from pathlib import Path

from .checkout import is_checkout
from .errors import BenchError
from .native import SOURCE_FOLDERS


class GitRefusal(Exception):
    """What git says, its first line; nothing if it is quiet."""


def commit_named(source: Path, name: str) -> str:
    """The full name of a commit that git knows by ``name``; raises BenchError if there is
    none."""
    try:
        found = git(
            *(source, "rev-parse", "--verify", "--quiet"),
            *("--end-of-options", f"{name}^{{commit}}"),
        )
    except GitRefusal as refusal:
        if str(refusal):
            raise BenchError(f"git in {source}: {refusal}") from refusal
        raise BenchError(
            f"{source} has no commit '{name}': name one that `git log` lists"
        ) from refusal
    return found.decode().strip()


def sources_of(source: Path, commit: str, cache: Path) -> Path:
    """A folder with what the native side of that commit is compiled from, which stays in
    the cache.

    commit: its full name. Raises BenchError if it is not there, or has no benchmarks.
    """
    folder = cache / "commits" / commit
    if is_checkout(folder):
        return folder
    shutil.rmtree(folder, ignore_errors=True)  # a damaged one
    try:
        archive = git(source, "archive", "--format=zip", commit, "--", *SOURCE_FOLDERS)
    except GitRefusal as refusal:
        raise BenchError(
            f"commit {commit[:10]} has no {' and '.join(SOURCE_FOLDERS)} to compile (git: "
            f"{refusal}): name a later one"
        ) from refusal
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=".commit-") as temporary:
        unpacked = Path(temporary) / "sources"
        with zipfile.ZipFile(io.BytesIO(archive)) as sources:
            sources.extractall(unpacked)
        if not is_checkout(unpacked):
            raise BenchError(f"commit {commit[:10]} has no benchmarks: name a later one")
        if not folder.is_dir():
            unpacked.rename(folder)
    return folder


def git(source: Path, *arguments: str) -> bytes:
    """What git prints. Raises GitRefusal if it refuses, and BenchError if there is none."""
    try:
        return subprocess.run(
            ["git", "-C", str(source), *arguments], capture_output=True, check=True
        ).stdout
    except OSError as error:
        raise BenchError(f"git cannot be run ({error.strerror}): install it") from error
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode(errors="replace").strip()
        raise GitRefusal(said.partition("\n")[0]) from error
