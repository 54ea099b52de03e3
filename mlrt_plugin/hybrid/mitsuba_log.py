"""What Mitsuba logs, in a file or as sentences in place of lines on the terminal."""

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
def captured_log(level: Any) -> Iterator[Any]:
    """Sends Mitsuba's messages of this level and above, a `mi.LogLevel`, to a file for a
    while; yields its appender."""
    logger = mitsuba.logger()
    appenders = [logger.appender(i) for i in range(logger.appender_count())]
    usual_level = logger.log_level()
    with tempfile.TemporaryDirectory() as folder:
        log = mitsuba.StreamAppender(str(Path(folder) / "log"))
        logger.clear_appenders()
        logger.add_appender(log)
        logger.set_log_level(level)
        try:
            yield log
        finally:
            logger.set_log_level(usual_level)
            logger.clear_appenders()
            for appender in appenders:
                logger.add_appender(appender)


@contextmanager
def captured_warnings() -> Iterator[list[str]]:
    """A list that holds, in the end, what Mitsuba has warned of in this context."""
    messages: list[str] = []
    with captured_log(mi.LogLevel.Warn) as log:
        try:
            yield messages
        finally:
            text = re.sub(r"\x1b\[[0-9;]*m", "", log.read_log())
            for line in text.splitlines():
                match = WARNING.search(line)
                if match:
                    messages.append(f"Mitsuba: {match[1].strip().rstrip('!.')}")
