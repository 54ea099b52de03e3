"""Fixtures that tests of several folders share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

# First, as Dr.Jit keeps the libLLVM that it finds when it is imported.
import mlrt_plugin  # noqa: F401  # isort: skip
import mitsuba as mi
import pytest
import repository
import scene_files
from mitsuba_worker import MitsubaWorker, Unavailable


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--full",
        action="store_true",
        help="take the numbers of rays and samples that are published, not a share of them",
    )


@pytest.fixture
def full(request: pytest.FixtureRequest) -> bool:
    """Whether the run is to take its full size."""
    return bool(request.config.getoption("--full"))


@pytest.fixture
def shared_scene() -> Callable[[str], Path]:
    """Finds a third-party scene beside the checkout; the test is skipped if it is
    absent."""

    def find(name: str) -> Path:
        path = repository.ROOT.parent / "shared" / "scenes" / name
        if not path.is_file():
            pytest.skip(f"third-party scene {name} is not beside the checkout")
        return path

    return find


@pytest.fixture
def scene_file(tmp_path: Path) -> Callable[..., Path]:
    """Writes a scene of `scene_files.scene_xml` into the test's folder."""

    def write(name: str = "scene.xml", **parts: str) -> Path:
        path = tmp_path / name
        path.write_text(scene_files.scene_xml(**parts))
        return path

    return write


@pytest.fixture(scope="session")
def mitsuba_llvm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[MitsubaWorker]:
    """Mitsuba's llvm_ad_rgb in a process beside, for references; skips by name where it
    finds no libLLVM."""
    try:
        worker = MitsubaWorker(tmp_path_factory.mktemp("mitsuba"))
    except Unavailable as error:
        pytest.skip(f"Mitsuba's llvm_ad_rgb: {error}")
    yield worker
    worker.close()


@pytest.fixture
def scalar_variant() -> Iterator[None]:
    """Runs a test in `scalar_rgb`."""
    mi.set_variant("scalar_rgb")
    yield
