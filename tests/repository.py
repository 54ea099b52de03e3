"""The files of the checkout that the tests run in."""

from __future__ import annotations

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def tracked_files(*patterns: str) -> list[Path]:
    """Returns the files under version control that match git patterns, relative to ROOT.

    Without git, or outside a checkout, every file of the source folders is taken.
    """
    command = ["git", "-C", str(ROOT), "ls-files", "-z", "--", *patterns]
    try:
        listing = subprocess.run(command, capture_output=True, check=True, text=True).stdout
        names = [Path(name) for name in listing.split("\0") if name]
    except (OSError, subprocess.CalledProcessError):
        folders = ("cpp", "mlrt_plugin", "compare", "scenes", "tests")
        names = [
            path.relative_to(ROOT)
            for folder in folders
            for path in (ROOT / folder).rglob("*")
            if path.is_file() and "__pycache__" not in path.parts
        ]
        names = [name for name in names if any(name.match(pattern) for pattern in patterns)]
    return [name for name in names if (ROOT / name).is_file()]
