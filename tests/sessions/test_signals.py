"""The filter and the peaks are SciPy's, whether its compiled filter is found where it is sought or not."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import signal

from sessions.strokes import forces as signals


@pytest.fixture(params=["compiled", "by the front door"])
def either(request, monkeypatch):
    if request.param == "by the front door":
        monkeypatch.setattr(signals, "_compiled_filter", lambda: None)


@pytest.mark.usefixtures("either")
@pytest.mark.parametrize(("n", "cut_off", "rate", "padding"), [(300, 24.9, 200.0, 30), (12, 24.9, 62.5, 11)])
def test_the_filter_is_scipys_butterworth_run_forwards_and_backwards(n, cut_off, rate, padding):
    values = np.random.default_rng(1).normal(size=(n, 6)).cumsum(axis=0) + 5.0
    sections = signal.butter(2, cut_off, fs=rate, output="sos")
    expected = signal.sosfiltfilt(sections, values, axis=0, padlen=padding)
    assert signals.low_pass(values, cut_off, rate, padding) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_peaks_and_how_far_they_stand_out_are_scipys_flat_tops_included():
    values = np.maximum(np.round(np.random.default_rng(2).normal(size=200).cumsum(), 0), 0.0)
    places, properties = signal.find_peaks(values, prominence=0.0)
    assert [peak.tolist() for peak in signals.peaks(values)] == [places.tolist(), properties["prominences"].tolist()]


def test_a_session_is_analysed_without_waiting_for_the_whole_of_scipys_signals():
    use = "import sys, numpy as np; from sessions.strokes.forces import low_pass, peaks; "
    use += "low_pass(np.ones((20, 1)), 20.0, 200.0, 3); peaks(np.ones(3)); "
    process = subprocess.run(
        [sys.executable, "-c", use + "print('scipy.signal' in sys.modules, 'scipy.stats' in sys.modules)"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert process.stdout.split() == ["False", "False"]
