"""The native side of mlrt-bench is compiled once, into a folder of the test session."""

from __future__ import annotations

from pathlib import Path

import pytest
import repository
from mlrt_compare.bench import native as bench_native
from mlrt_compare.bench.errors import BenchError
from mlrt_compare.bench.native import Native, load_native
from mlrt_compare.bench.scenes import BenchScene, chosen_scenes, usual_scenes


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="session")
def native(cache: Path) -> Native:
    try:
        bench_native.find_tools()
    except BenchError as error:
        pytest.skip(str(error))
    return load_native(repository.ROOT, cache)


@pytest.fixture(scope="session")
def office(cache: Path) -> BenchScene:
    return chosen_scenes(["office"], usual_scenes(repository.ROOT))[0].load(cache)
