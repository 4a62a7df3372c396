"""Start of the recorder's process; `client.py` starts it."""

import sys

from daq_app.child_process import use_one_thread

if __name__ == "__main__":
    use_one_thread()
    from daq_app.recorder.process import main  # after that: it imports numpy

    main(sys.argv[1:])
