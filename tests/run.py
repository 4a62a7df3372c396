"""Every check of the project, each with what it proves and how long it took.

`make test` runs the quick ones, `make test-long` those that take minutes: endurance, and the complete lists of cases.
"""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STATIC = [
    ("the code is formatted in one way", ["ruff", "format", "--check", "."]),
    ("the code keeps the house's rules", ["ruff", "check", "."]),
    ("imports go one way", ["lint-imports", "--no-cache"]),
    ("types agree (strict)", ["pyrefly", "check", "--python-interpreter-path", sys.executable]),
]
# A file's tests stay together, so that what they share is made once. On two cores a third worker runs while the others
# wait for devices, whose tests go by the clock.
PARALLEL = ["pytest", "-n", "3", "--dist", "loadfile"]
QUICK = [("every sentence a test proves", [*PARALLEL, "-m", "not slow and not hardware"])]
LONG = [
    ("every slow sentence", [*PARALLEL, "-m", "slow", "--ignore", "tests/endurance", "tests"]),
    (
        "every law on fresh examples",
        [*PARALLEL, "-m", "hypothesis and not slow", "--hypothesis-profile", "fresh examples"],
    ),
    ("the endurance runs", ["pytest", "-s", "-m", "slow", "tests/endurance"]),
]


def main() -> int:
    """Run the checks, all of them even when one fails, and return the exit code."""
    checks = LONG if "--long" in sys.argv[1:] else [*STATIC, *QUICK]
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # without bytecode each process takes seconds to begin
    compiling = subprocess.Popen([sys.executable, "-m", "tests.compile_first"], cwd=ROOT, env=environment)
    failed = 0
    for sentence, command in checks:
        if command[0] == "pytest":
            compiling.wait()
        print(f"── {sentence}: {' '.join(command)}", flush=True)
        began = time.monotonic()
        passed = subprocess.run(installed(command), cwd=ROOT, env=environment, check=False).returncode == 0
        failed += not passed
        print(f"── {'passed' if passed else 'FAILED'} in {time.monotonic() - began:.0f} s", flush=True)
    return 1 if failed else 0


def installed(command: list[str]) -> list[str]:
    """Return the command as installed beside this interpreter, so that no path has to be set."""
    program = shutil.which(command[0], path=str(Path(sys.executable).parent))
    if program is None:
        sys.exit(f"{command[0]} is not installed beside {sys.executable}: run 'make test', which installs it")
    return [program, *command[1:]]


if __name__ == "__main__":
    sys.exit(main())
