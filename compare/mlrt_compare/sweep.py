"""Many comparisons, each in a process of its own, and all of their results kept.

A result is a file that is named by what it depends on, so that a sweep that was ended
continues where it was: what is there is not run again.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mlrt_plugin._dispatch import core

from .options import COULD_NOT_RUN, FAILED, PASSED, CannotRun, write_json
from .scene_hash import file_hash, scene_hash
from .settings import Settings

Result = dict[str, Any]


@dataclass(frozen=True)
class Job:
    """One comparison of `mlrt-compare SCENE`."""

    settings: Settings
    rounds: int

    def arguments(self) -> list[str]:
        """Of the command line, but for what it writes."""
        settings = self.settings
        words = [str(settings.scene.resolve()), f"--rounds={self.rounds}"]
        words += [f"--seed={settings.seed}", f"-s{settings.sensor}"]
        if settings.spp is not None:
            words.append(f"--spp={settings.spp}")
        if settings.resolution is not None:
            words.append("--resolution={}x{}".format(*settings.resolution))
        if settings.threads is not None:
            words.append(f"-t{settings.threads}")
        if settings.shading is not None:
            words.append(f"--shading={settings.shading}")
        words += [f"-a{folder.resolve()}" for folder in settings.folders]
        return words + [f"-D{key}={value}" for key, value in settings.defines.items()]

    def name(self) -> str:
        """Of its result: the scene's, the samples, and a hash of all that it depends on.

        Raises SceneError if the scene cannot be read.
        """
        settings = self.settings
        depends = (
            scene_hash(settings),
            (settings.spp, settings.seed, settings.threads, self.rounds, settings.shading),
            # The version alone does not tell one build from another.
            (file_hash(Path(str(core.__file__))), version("mitsuba"), version("drjit")),
        )
        digest = hashlib.sha256(repr(depends).encode()).hexdigest()[:16]
        samples = "" if settings.spp is None else f"-{settings.spp}spp"
        return f"{settings.scene.stem}{samples}-{digest}"


def run_job(arguments: Sequence[str]) -> Result:
    """Runs `mlrt-compare` and returns its figures with its exit code, or the error that
    kept it from running."""
    with tempfile.TemporaryDirectory(prefix="mlrt-compare-") as folder:
        figures = Path(folder) / "figures.json"
        child = subprocess.run(
            # -P: the current folder may hold a checkout, without its native core.
            [
                *(sys.executable, "-P", "-m", "mlrt_compare", "scene", *arguments),
                *("-o", folder, "--json", str(figures)),
            ],
            capture_output=True,
            text=True,
        )
        if child.returncode in (PASSED, FAILED) and figures.is_file():
            result: Result = json.loads(figures.read_text())
            return {**result, "code": child.returncode}
        lines = child.stderr.strip().splitlines() or [f"it ended with {child.returncode}"]
        return {
            "code": COULD_NOT_RUN,
            "error": lines[-1].removeprefix("mlrt-compare: "),
            "interrupted": child.returncode in (130, -2, -15),
        }


class Results:
    """The results in a folder, a file each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CannotRun(
                f"the folder {folder} cannot be made: {error.strerror}"
            ) from error

    def load(self, name: str) -> Result | None:
        """What is kept of a job; None if nothing is, or if it could not run."""
        try:
            result: Result = json.loads((self.folder / f"{name}.json").read_text())
        except (OSError, ValueError):
            return None
        return result if result.get("code") in (PASSED, FAILED) else None

    def store(self, name: str, result: Result) -> None:
        write_json(self.folder / f"{name}.json", result)


Executor = Callable[[Sequence[list[str]]], Iterator[tuple[int, Result]]]
"""Runs jobs of the given arguments; yields their numbers and results as they come."""


def locally(processes: int) -> Executor:
    """Runs so many at a time on this machine."""

    def run(jobs: Sequence[list[str]]) -> Iterator[tuple[int, Result]]:
        with ThreadPoolExecutor(processes) as pool:
            numbers = {pool.submit(run_job, job): i for i, job in enumerate(jobs)}
            try:
                for future in as_completed(numbers):
                    yield numbers[future], future.result()
            finally:
                pool.shutdown(wait=True, cancel_futures=True)

    return run


def on_dask(address: str) -> Executor:
    """Runs on the workers of a Dask scheduler, which must find the scenes at the same
    paths. Raises CannotRun if it cannot be reached."""

    def run(jobs: Sequence[list[str]]) -> Iterator[tuple[int, Result]]:
        with client_of(address) as client:
            numbers = {
                future: i for i, future in enumerate(client.map(run_job, jobs, pure=False))
            }
            for future in dask().as_completed(list(numbers)):
                yield numbers[future], future.result()

    return run


def dask() -> Any:
    """The package distributed, of which not all is typed. Raises CannotRun without it."""
    try:
        return importlib.import_module("distributed")
    except ModuleNotFoundError as error:
        raise CannotRun(
            "the package distributed is missing: pip install 'mlrt[sweep]'"
        ) from error


@contextmanager
def client_of(address: str) -> Iterator[Any]:
    try:
        client = dask().Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        reason = " ".join(str(error).split())
        raise CannotRun(f"there is no Dask scheduler at {address}: {reason}") from error
    try:
        yield client
    finally:
        client.close()


def sweep(
    jobs: Sequence[Job],
    results: Results,
    executor: Executor,
    report: Callable[[str, Result, bool], object],
) -> list[Result]:
    """Runs the jobs that have no result yet and keeps each as soon as it is there.

    report: called with the name, the result, and whether it was there before. Returns all
    results in the order of the jobs, each with its name.
    """
    names = [job.name() for job in jobs]
    found = {name: results.load(name) for name in names}
    for name in names:
        kept = found[name]
        if kept is not None:
            report(name, kept, True)
    waiting = [
        number
        for number, name in enumerate(names)
        if found[name] is None and name not in names[:number]
    ]
    for which, result in executor([jobs[number].arguments() for number in waiting]):
        number = waiting[which]
        if result.get("interrupted"):
            raise KeyboardInterrupt
        whole = {**result, "scene": str(jobs[number].settings.scene)}
        results.store(names[number], whole)
        found[names[number]] = whole
        report(names[number], whole, False)
    return [{"name": name, **(found[name] or {})} for name in names]
