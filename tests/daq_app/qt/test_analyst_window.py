"""The analyst's window, driven as a person does, on a recorded session that is analysed by the real work."""

import time
from pathlib import Path

import pytest

from daq_app import analyst as a
from daq_app.qt.analyst_window import AnalystWindow
from daq_app.qt.tokens import LIGHT
from sessions.exports.figures.course import course_panel
from sessions.exports.figures.style import Plate, in_pixels, look
from tests.sessions.report_example import example

SESSION = Path(__file__).parents[2] / "data" / "sessions" / "version-1" / "sealed"


class Nobody:
    """Work that never ends by itself."""

    def poll(self):
        return ()

    def write(self, asked):
        """Do nothing."""

    def cancel(self):
        return a.Cancelled()


@pytest.fixture
def window(application):
    made = AnalystWindow(SESSION, LIGHT, Nobody())
    made.show()
    yield made
    made.close()
    application.processEvents()


@pytest.fixture(scope="module")
def found():
    report = example()
    with look(), in_pixels() as pixels:
        panel = course_panel(report.course, report.strokes, simulated=True)
    return a.Found("predicted", report, (Plate("course", "", (panel,)),), pixels)


def until(application, condition):
    end = time.monotonic() + 120.0  # of a machine that hangs, not of a slow one
    while not condition():
        assert time.monotonic() < end
        application.processEvents()
        time.sleep(0.005)


def test_a_point_of_prediction_against_score_chooses_its_trial_in_every_column(window, found):
    window.take(found)
    point = a.points(window.state)[-1]
    spot = next(s for s in window._points.points() if s.data() == point.row)
    window._point_clicked(None, [spot])
    assert window.trials.currentRow() == point.row
    assert window.stroke.accessibleName().endswith(f"stroke {a.chosen(window.state).stroke.number}")


def test_stopping_answers_at_once_and_keeps_what_was_found(window, found):
    window.take(found)
    window.take(a.Step(0.5, "predicting"))
    window.stop.click()
    assert window.state.step is None
    assert "kept" in window.state.told
    assert window.trials.count() == len(a.rows(window.state))


def test_every_picture_is_saved_as_svg_png_and_csv(window, found, tmp_path):
    window.take(found)
    for ending in ("svg", "png", "csv"):
        window.picture.save(tmp_path / f"picture.{ending}")
    assert (tmp_path / "picture.svg").read_text().lstrip().startswith("<?xml")
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")
    panel = a.pictures(window.state)[0]
    assert (tmp_path / "picture.csv").read_text().count("\n") >= len(panel.rows)


def test_a_recorded_session_is_opened_and_analysed_while_the_window_stays_alive(application):
    window = AnalystWindow(SESSION, LIGHT)
    until(application, lambda: window.state.step is None or window.state.stage != "opening")
    assert window.state.report is not None, window.state.told
    assert window.state.report.session == SESSION.name
    window.close()
