"""Start of the recorder's process; `client.py` starts it."""

import os
import sys

if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when numpy is imported
    from daq_app.recorder.process import main

    main(sys.argv[1:])
