"""The reports that the script of the window's pictures plays are those of the recorder."""

from benchmarks.screenshots import BEGINNING, CUT_SHORT, ENDED, OPEN
from tests.daq_app.session_messages import after


def test_the_played_reports_open_a_bench_and_begin_and_end_a_session():
    assert after(*OPEN).bench.link == "open"
    assert not after(*OPEN, *BEGINNING).session.is_over
    assert after(*OPEN, *BEGINNING, ENDED).session.is_over
    assert after(*OPEN, *BEGINNING, CUT_SHORT).session.is_over
