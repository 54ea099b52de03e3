"""mlrt-bench in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import repository


def command(
    *arguments: object, cwd: Path = repository.ROOT, **environment: str
) -> subprocess.CompletedProcess[str]:
    # -P: a checkout that is the current folder holds packages without native core.
    return subprocess.run(
        [sys.executable, "-P", "-m", "mlrt_compare.bench", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=cwd,
        env={**os.environ, **environment},
    )


def assert_one_sentence(child: subprocess.CompletedProcess[str], *said: str) -> None:
    assert child.returncode == 4, child.stdout + child.stderr
    lines = child.stderr.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("mlrt-bench: "), child.stderr
    for words in said:
        assert words in lines[0]
