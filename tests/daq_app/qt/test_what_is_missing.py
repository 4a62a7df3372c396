"""A computer that lacks what the window needs."""

import ctypes

import pytest

from daq_app.qt.start import what_is_missing

pytestmark = pytest.mark.qt


def test_one_sentence_names_every_library_that_is_to_be_installed(monkeypatch):
    def load(library):
        if "icccm" in library or "keysyms" in library:
            raise OSError(library)
        return library

    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr(ctypes, "CDLL", load)
    monkeypatch.setenv("QT_QPA_PLATFORM", "xcb")
    monkeypatch.setenv("DISPLAY", ":0")
    sentence = what_is_missing()
    assert "libxcb-icccm.so.4, libxcb-keysyms.so.1" in sentence
    assert sentence.endswith("libxcb-icccm4 libxcb-keysyms1")
