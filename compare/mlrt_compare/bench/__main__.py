"""``python -m mlrt_compare.bench`` is the command mlrt-bench."""

from __future__ import annotations

import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
