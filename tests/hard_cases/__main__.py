"""All hard cases with the core of each instruction set that runs here, by case.

    PYTHONPATH=tests python -P -m hard_cases [PYTEST ARGUMENT]...

Exits with 1 if a test fails, or if a case passes no test on some instruction set.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from mlrt_plugin._dispatch import available_isas

FOLDER = Path(__file__).parent
CASES = range(1, 41)
Outcome = dict[str, Any]
NONE: Outcome = {"passed": 0, "failed": 0, "skipped": 0, "reasons": []}


def outcomes(isa: str, arguments: list[str]) -> dict[int, Outcome]:
    """Runs the tests with one core; what came of each case."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "outcomes.json"
        command = [sys.executable, "-P", "-m", "pytest", "-q", "-p", "hard_cases.outcomes"]
        options = ["--outcomes", str(file), "--only-core", isa]
        subprocess.run(
            [*command, *options, *arguments, str(FOLDER)],
            cwd=FOLDER.parents[1],
            env=os.environ | {"MLRT_ISA": isa},
            stdout=sys.stderr,
        )
        if not file.is_file():
            raise SystemExit(f"the tests did not run with {isa}")
        return {int(number): case for number, case in json.loads(file.read_text()).items()}


def told(case: Outcome) -> str:
    words = [
        f"{case[word]} {word}" for word in ("passed", "failed", "skipped") if case[word]
    ]
    reasons = "; ".join(dict.fromkeys(case["reasons"]))
    return (", ".join(words) or "not run") + (f" ({reasons})" if reasons else "")


def main(arguments: list[str]) -> int:
    good = True
    isas = available_isas()
    found = {isa: outcomes(isa, arguments) for isa in isas}
    for number in CASES:
        for isa in isas:
            case = found[isa].get(number, NONE)
            good &= case["passed"] > 0 and case["failed"] == 0
            print(f"{number:2}  {isa:8}{told(case)}")
    print(f"{len(CASES)} cases, {' and '.join(isas)}: {'green' if good else 'NOT green'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
