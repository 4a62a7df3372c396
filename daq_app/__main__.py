"""Start of the program."""

import os
import sys

from daq_app.cli import run


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
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
