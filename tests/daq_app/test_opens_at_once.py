"""What the window and the recorder load before they stand."""

import subprocess
import sys

import pytest

SLOW = "{'scipy', 'numba', 'matplotlib', 'pyqtgraph', 'h5py'}"  # each costs a tenth of the time there is, or more


@pytest.mark.qt
def test_the_window_and_its_recorder_open_without_the_libraries_that_load_slowly():
    loads = f"import sys, daq_app.qt.main_window, daq_app.recorder.pipes; print({SLOW} & set(sys.modules))"
    run = subprocess.run([sys.executable, "-c", loads], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "set()"
