import io
import json
import threading

import pytest

from daq_app.console import Console, Underway
from solver.telling import listening, tell


def console(*, as_json):
    out, err = io.StringIO(), io.StringIO()
    return Console(as_json=as_json, out=out, err=err), out, err


def test_with_json_stdout_holds_one_document_and_nothing_else():
    speaker, out, err = console(as_json=True)
    speaker.say("for people")
    speaker.progress(0.5, "half")
    speaker.note("a warning")
    speaker.result({"a": 1.5})
    assert json.loads(out.getvalue()) == {"a": 1.5}
    assert "a warning" in err.getvalue()


def test_without_json_the_document_stays_unsaid():
    speaker, out, _ = console(as_json=False)
    speaker.say("for people")
    speaker.result({"a": 1})
    assert out.getvalue() == "for people\n"


def test_a_number_that_is_none_never_becomes_json():
    speaker, _, _ = console(as_json=True)
    with pytest.raises(ValueError, match="not JSON compliant"):
        speaker.result({"a": float("nan")})


def test_the_part_shown_of_work_whose_end_nobody_knows_moves_and_never_goes_back_nor_ends_before_it():
    work, shown = Underway("solving"), []
    for doing, part in [("solving on a mesh", 0.0), ("following", 0.5), ("following", 1.0), ("following", 0.2)]:
        with listening(work.hear):
            tell(doing, part)
        shown.append((work.doing, work.part))
    work.hear("estimating", 0.5)
    work.reach(1.0)
    assert shown == [("solving on a mesh", 0.0), ("following", 0.25), ("following", 0.5), ("following", 0.5)]
    assert (work.doing, work.part) == ("estimating", 0.99)


def test_work_whose_end_nobody_knows_shows_how_long_it_has_taken_and_can_still_be_left(monkeypatch):
    monkeypatch.setattr("daq_app.console.PATIENCE", 0.0)
    speaker, _, err = console(as_json=False)

    def work():
        with speaker.working("solving") as told:
            assert told(0.4)
            while "solving" not in err.getvalue():
                pass
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert "s so far; Ctrl-C stops" in err.getvalue()
    assert all(thread.name != "progress" for thread in threading.enumerate())
