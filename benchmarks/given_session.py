"""The session that a measurement is made on: the one that was named, or a simulated one, recorded first."""

import sys
from pathlib import Path

from daq_app.cli.main import run

WORDS = ("run", "sensotact-friction", "--device", "sim:?seed=7&rate=200", "--subject", "P01", "--headless")


def given_session(room: Path) -> Path:
    """Return the folder named on the command line; without one, that of a session recorded in `room`."""
    if len(sys.argv) > 1:
        return Path(sys.argv[1])
    folder = room / "session"
    run([*WORDS, "--simulate-subject", "1", "--seed", "3", "--pace", "20", "--out", str(folder)])
    return folder
