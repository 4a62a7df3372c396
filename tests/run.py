"""Every check of the project, each with what it proves and how long it took.

`make test` runs the quick ones, `make test-long` those that take minutes: endurance, and the complete lists of cases.
"""

import hashlib
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from importlib.metadata import distributions
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
AGREED = Path(sys.prefix) / "types-agree"  # the digest of the code whose types agreed last
PACKAGES = ["daq_app", "drivers", "sessions", "simulators", "solver"]
STATIC = [
    ("the code is formatted in one way", ["ruff", "format", "--check", "."]),
    ("the code keeps the house's rules", ["ruff", "check", "."]),
    ("imports go one way", ["lint-imports", "--no-cache"]),
]
# One thread works for a minute and a half. It runs beside all the others, and what it prints comes after theirs. It
# does not run where not a byte has changed since it passed.
BACKGROUND = [("types agree (strict)", ["basedpyright", "--level", "error", *PACKAGES])]
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
    long = "--long" in sys.argv[1:]
    checks, unhurried = (LONG, []) if long else ([*STATIC, *QUICK], BACKGROUND)
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)  # without bytecode each process takes seconds to begin

    def passes(command: list[str], *, quiet: bool = False) -> tuple[bool, str, str]:
        """Run one check; return whether it passed, what to say of that, and its output if it is to be `quiet`."""
        began = time.monotonic()
        out, err = (subprocess.PIPE, subprocess.STDOUT) if quiet else (None, None)
        process = subprocess.run(
            installed(command), cwd=ROOT, env=environment, stdout=out, stderr=err, text=True, check=False
        )
        passed = process.returncode == 0
        return passed, f"{'passed' if passed else 'FAILED'} in {time.monotonic() - began:.0f} s", process.stdout or ""

    digest = typed_code()
    if unhurried and AGREED.is_file() and AGREED.read_text() == digest:
        print(f"── {unhurried[0][0]}: in this very code, as checked before", flush=True)
        unhurried = []
    compiling = subprocess.Popen([sys.executable, "-m", "tests.compile_first"], cwd=ROOT, env=environment)
    failed = 0
    with ThreadPoolExecutor() as pool:
        background = [(sentence, command, pool.submit(passes, command, quiet=True)) for sentence, command in unhurried]
        for sentence, command in checks:
            if command[0] == "pytest":
                compiling.wait()
            print(f"── {sentence}: {' '.join(command)}", flush=True)
            passed, verdict, _ = passes(command)
            failed += not passed
            print(f"── {verdict}", flush=True)
        for sentence, command, future in background:
            passed, verdict, output = future.result()
            failed += not passed
            if passed:
                AGREED.write_text(digest)
            print(f"── {sentence}: {' '.join(command)}\n{output}── {verdict}", flush=True)
    return 1 if failed else 0


def typed_code() -> str:
    """Return a digest of the code, its settings and the versions of installed packages, which determine the types."""
    digest = hashlib.sha256()
    for path in [ROOT / "pyproject.toml", *(path for name in PACKAGES for path in sorted((ROOT / name).rglob("*.py")))]:
        digest.update(f"{path.relative_to(ROOT)}\n".encode() + path.read_bytes())
    versions = sorted(f"{one.metadata['Name']} {one.version}" for one in distributions())
    return digest.hexdigest() + hashlib.sha256("\n".join([sys.version, *versions]).encode()).hexdigest()


def installed(command: list[str]) -> list[str]:
    """Return the command as installed beside this interpreter, so that no path has to be set."""
    program = shutil.which(command[0], path=str(Path(sys.executable).parent))
    if program is None:
        sys.exit(f"{command[0]} is not installed beside {sys.executable}: run 'make test', which installs it")
    return [program, *command[1:]]


if __name__ == "__main__":
    sys.exit(main())
