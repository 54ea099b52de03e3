"""mlrt-compare in a process of its own."""

from __future__ import annotations

import os
import subprocess
import sys

# Runs the command with MLRT's images bent by a function: a wrong renderer must be found
# out.
BENT = """
import sys
from mlrt_compare import cli, llvm
llvm.activate()
from mlrt_compare.mlrt_renderer import MlrtRenderer
right = MlrtRenderer.image.fget
MlrtRenderer.image = property(lambda renderer: bend(right(renderer)))
def bend(image):
    return {how}
sys.exit(cli.main(sys.argv[1:]))
"""


def python(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    # -P: the checkout, where tests are run from, holds mlrt_plugin without its native core.
    return subprocess.run(
        [sys.executable, "-P", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, **environment},
    )
