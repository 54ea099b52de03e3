"""Each native module holds code for its own instruction set only, without contraction."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from mlrt_plugin import _dispatch

# What a module must not hold and, so that the search itself is tested, what it certainly
# holds. Registers 16 to 31 and masks exist with AVX-512 only.
AVX512 = r"%zmm|%[xyz]mm(?:1[6-9]|2\d|3[01])\b|\{%k\d\}"
FORBIDDEN = {"_cpu": r"%[yz]mm|%k\d\b", "_core_avx2": AVX512, "_core_avx512": None}
PRESENT = {"_cpu": r"%r[as][xp]", "_core_avx2": r"%ymm", "_core_avx512": r"%zmm"}


def module_file(name: str) -> Path:
    spec = importlib.util.find_spec(f"mlrt_plugin.{name}")
    if spec is None or spec.origin is None:
        pytest.skip(f"module {name} is not built for this processor family")
    return Path(spec.origin)


@pytest.mark.parametrize("name", sorted(FORBIDDEN))
def test_instructions_belong_to_the_module(name: str) -> None:
    objdump = shutil.which("objdump")
    if objdump is None:
        pytest.skip("objdump (binutils) is not installed")
    command = [objdump, "--disassemble", "--no-show-raw-insn", str(module_file(name))]
    forbidden, present = FORBIDDEN[name], re.compile(PRESENT[name])
    found = False
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        wrong = []
        for line in process.stdout:
            found = found or present.search(line) is not None
            if forbidden is not None and re.search(forbidden, line):
                wrong.append(line.rstrip())
    assert process.returncode == 0
    assert found
    assert wrong[:5] == []


@pytest.mark.parametrize("isa", _dispatch.available_isas())
def test_products_are_rounded_before_the_difference(isa: str) -> None:
    core = _dispatch.load_core(isa)
    assert core.isa == isa
    # a * a = 1 + 2^-11 + 2^-24, of which only a fused operation keeps the last term.
    a = 1 + 2.0**-12
    assert core.multiply_subtract(a, a, 1 + 2.0**-11) == 0
    assert core.multiply_subtract(a, a, 1) == 2.0**-11
