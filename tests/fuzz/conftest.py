"""The process that random input is fed to, and how much of it."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from fuzz_process import FuzzProcess
from hypothesis import HealthCheck, Phase, settings

VARIABLE = "MLRT_FUZZ_EXAMPLES"
settings.register_profile(
    "fuzz",
    max_examples=int(os.environ.get(VARIABLE, "30")),
    deadline=None,
    print_blob=True,
    # The process is the same for all examples, and may be.
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    phases=[Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink],
)


@pytest.fixture(scope="session")
def process() -> Iterator[FuzzProcess]:
    process = FuzzProcess()
    yield process
    process.close()
