"""What Mitsuba warns of, as sentences in place of lines on the terminal."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mitsuba as mi

mitsuba: Any = mi
"""For what Mitsuba's type stubs leave out."""

WARNING = re.compile(r" WARN +(?:\[[\w.]+:\d+\] )?(.*)")


@contextmanager
def captured_warnings() -> Iterator[list[str]]:
    """A list that holds, in the end, what Mitsuba has warned of in this context."""
    logger = mitsuba.logger()
    appenders = [logger.appender(i) for i in range(logger.appender_count())]
    level = logger.log_level()
    messages: list[str] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "log"
        log = mitsuba.StreamAppender(str(file))
        logger.clear_appenders()
        logger.add_appender(log)
        logger.set_log_level(mi.LogLevel.Warn)
        try:
            yield messages
        finally:
            logger.set_log_level(level)
            logger.clear_appenders()
            for appender in appenders:
                logger.add_appender(appender)
            text = re.sub(r"\x1b\[[0-9;]*m", "", log.read_log())
            for line in text.splitlines():
                match = WARNING.search(line)
                if match:
                    messages.append(f"Mitsuba: {match[1].strip().rstrip('!.')}")
