"""Start of the program."""

import multiprocessing
import os
import sys
from typing import NoReturn

from daq_app.cli import STOPPED, run


def main() -> None:
    """Run the command line, or without one open the window, and leave with the exit code."""
    # The solver's matrices are small: threads of the linear algebra only wait for each other (2 to 10 times slower).
    # Read when numpy is imported, which no module has done by now.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if len(sys.argv) == 1:
        from daq_app.qt.start import main as open_window  # the command line runs where Qt is not installed

        sys.exit(open_window())
    if sys.argv[1] == "window":
        from daq_app.qt.start import look_at

        sys.exit(look_at(sys.argv[2:]))
    _leave(run(sys.argv[1:]))


def _leave(code: int) -> NoReturn:
    """Leave with an exit code; at once where the user asked to stop and nothing is left to be ended."""
    if code == STOPPED and not multiprocessing.active_children():
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)  # taking the loaded libraries apart first takes longer than Ctrl-C may
    sys.exit(code)


if __name__ == "__main__":
    main()
