"""python -m mlrt_compare is the command mlrt-compare."""

from __future__ import annotations

import sys

from .cli import main

sys.exit(main())
