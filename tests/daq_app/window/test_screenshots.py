"""The reports that the script of the window's pictures plays are those of the recorder."""

from benchmarks.screenshots import BEGINNING, CUT_SHORT, ENDED, OPEN, PlayedRecorder
from daq_app.window.state import Tick, fold
from daq_app.window.view import derive_view
from tests.daq_app.session_messages import after


def test_the_played_reports_open_a_bench_and_begin_and_end_a_session():
    assert after(*OPEN).bench.link == "open"
    assert not after(*OPEN, *BEGINNING).session.is_over
    assert after(*OPEN, *BEGINNING, ENDED).session.is_over
    assert after(*OPEN, *BEGINNING, CUT_SHORT).session.is_over


def test_the_bench_of_the_pictures_is_healthy_however_long_the_window_works_on_a_session():
    recorder, state = PlayedRecorder(), after(*OPEN, Tick(60.0))
    assert derive_view(state).bench.lamp_text.startswith("no readings for")
    for report in recorder.poll():
        state = fold(state, report)
    assert derive_view(state).bench.lamp_text == "nothing lost"
