"""The window of Review on a recorded session."""

import pytest

from daq_app.analyst import state as m
from daq_app.analyst.state import AnalystState
from daq_app.qt.analyst_window import AnalystWindow
from daq_app.qt.tokens import LIGHT
from tests.daq_app.qt.review.examples import SESSION, Nobody
from tests.sessions.report_example import example


@pytest.fixture(scope="module")
def one_window(application):
    window = AnalystWindow(SESSION, LIGHT, Nobody())
    window.show()
    yield window
    window.close()
    application.processEvents()


@pytest.fixture
def window(one_window):
    """The window as it is when a session was just opened and predicted."""
    one_window.resize(1440, 900)
    one_window.state = AnalystState(SESSION)
    one_window.model.tabs.setCurrentIndex(0)
    one_window.take(m.ReportReady("predicted", example()))
    one_window.take(m.Idle())
    one_window._work.requests.clear()
    return one_window
