"""A process that random input is fed to, so that a crash is a failure of one test."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import tempfile
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

SECONDS = 120
"""After which a case counts as hanging."""


class FuzzProcess:
    """Starts the process, again after each crash, and hands it cases of `fuzz_cases`."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._start()

    def _start(self) -> None:
        self._connection, other = self._context.Pipe()
        self._process = self._context.Process(target=serve, args=(other,), daemon=True)
        self._process.start()
        other.close()

    def __call__(self, case: str, *arguments: Any) -> str:
        """`done`, or `refused: ` and why. Raises AssertionError for a crash, a hang, or
        whatever else the case does not allow."""
        try:
            self._connection.send((case, pickle.dumps(arguments)))
            if not self._connection.poll(SECONDS):
                self.close()
                self._start()
                raise AssertionError(f"{case} hangs")
            good, answer = self._connection.recv()
        except (EOFError, ConnectionError):
            self._process.join()
            code = self._process.exitcode
            self._start()
            raise AssertionError(f"{case} crashed with exit code {code}") from None
        assert good, answer
        return str(answer)

    def close(self) -> None:
        self._process.kill()
        self._process.join()
        self._connection.close()


def serve(connection: Connection) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    from fuzz_cases import outcome

    # Nothing is to be written, and nobody is to find it.
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        while True:
            try:
                case, pickled = connection.recv()
            except (EOFError, KeyboardInterrupt):
                return
            try:
                answer = True, outcome(case, pickled)
                assert not any(Path(folder).iterdir()), "files were left behind"
            except BaseException:
                answer = False, traceback.format_exc()
            connection.send(answer)
