import errno
import io
import json
import os
import sys
import threading

import pytest

from daq_app.cli.main import run
from daq_app.console import Console, EndlessProgress, NotWritten, Parser, accept_any_text
from solver.progress import listening, report_progress


def console(*, as_json):
    out, err = io.StringIO(), io.StringIO()
    return Console(as_json=as_json, out=out, err=err), out, err


def test_with_json_stdout_holds_one_document_and_nothing_else():
    speaker, out, err = console(as_json=True)
    speaker.say("for people")
    speaker.progress(0.5, "half")
    speaker.note("a warning")
    speaker.result(a=1.5)
    assert json.loads(out.getvalue()) == {"a": 1.5}
    assert "a warning" in err.getvalue()


def test_without_json_the_document_stays_unsaid():
    speaker, out, _ = console(as_json=False)
    speaker.say("for people")
    speaker.result(a=1)
    assert out.getvalue() == "for people\n"


def test_an_answer_that_the_output_has_no_letters_for_is_written_with_escapes():
    out = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    accept_any_text(out)
    Console(as_json=False, out=out).say("Ω – 1.5")
    assert out.buffer.getvalue() == rb"\u03a9 \u2013 1.5" + os.linesep.encode()


def test_a_terminal_is_shown_control_characters_and_does_not_obey_them(capsys):
    speaker, out, err = console(as_json=False)
    speaker.say("a\x1b[2Jb\x00\nc\x9bd")
    speaker.note("\x07")
    assert out.getvalue() == "a\\x1b[2Jb\\x00\nc\\x9bd\n"
    assert err.getvalue() == "\\x07\n"
    assert run(["\x1b[2J"]) == 2
    assert "\x1b" not in capsys.readouterr().err


def test_a_full_disk_is_reported_with_what_could_not_be_written_and_where():
    class Full(io.StringIO):
        def write(self, _):
            raise OSError(errno.ENOSPC, "No space left on device")

    for as_json in (True, False):
        speaker = Console(as_json=as_json, out=Full())
        with pytest.raises(NotWritten, match=r"the answer could not be written to standard output \(no space left"):
            speaker.result() if as_json else speaker.say("")


def test_what_is_said_beside_the_answer_stops_nothing_where_it_cannot_be_written():
    class Full(io.StringIO):
        def write(self, _):
            raise OSError(errno.ENOSPC, "No space left on device")

    out = io.StringIO()
    speaker = Console(as_json=False, out=out, err=Full())
    speaker.progress(0.5, "half")
    speaker.note("a warning")
    speaker.say("the answer")
    assert out.getvalue() == "the answer\n"


def test_a_package_that_is_missing_is_named_with_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "daq_app.cli.verbs.solve", None)  # one of our own: a fault of ours
    assert run(["solve", "scene.toml"]) == 1
    assert "unexpected ModuleNotFoundError" in capsys.readouterr().err

    def needs(_):
        raise ModuleNotFoundError("No module named 'llvmlite.binding'", name="llvmlite.binding")

    monkeypatch.setattr("daq_app.cli.main._dispatch", needs)
    assert run(["solve", "scene.toml"]) == 1
    output = capsys.readouterr().err
    assert output.startswith("daq-app: the Python package llvmlite is not installed; 'pip install ")


def test_a_number_that_is_none_never_becomes_json():
    speaker, _, _ = console(as_json=True)
    with pytest.raises(ValueError, match="not JSON compliant"):
        speaker.result(a=float("nan"))


def test_the_part_shown_of_work_whose_end_nobody_knows_moves_and_never_goes_back_nor_ends_before_it():
    work, states = EndlessProgress("solving"), []
    for doing, part in [("solving on a mesh", 0.0), ("following", 0.5), ("following", 1.0), ("following", 0.2)]:
        with listening(work.hear):
            report_progress(doing, part)
        states.append((work.task, work.fraction))
    work.hear("estimating", 0.5)
    work.reach(1.0)
    assert states == [("solving on a mesh", 0.0), ("following", 0.25), ("following", 0.5), ("following", 0.5)]
    assert (work.task, work.fraction) == ("estimating", 0.99)


class _Terminal(io.StringIO):
    encoding = "utf-8"

    def isatty(self):
        return True


def _lines_at_terminal(monkeypatch, calls, columns=80):
    """Return what a terminal is shown of (instant [s], part done, end known)."""
    err = _Terminal()
    speaker, now = Console(as_json=False, err=err), [0.0]
    monkeypatch.setattr("daq_app.console.time.monotonic", lambda: now[0])
    monkeypatch.setattr("daq_app.console.os.get_terminal_size", lambda _: os.terminal_size((columns, 24)))
    monkeypatch.setattr(err, "fileno", lambda: 2)
    for instant, part, end_known in calls:
        now[0] = instant
        speaker.progress(part, "solving", end_known=end_known)
    speaker.note("over")
    assert err.getvalue().endswith("\nover\n")
    return err.getvalue().removesuffix("\nover\n").split("\r\x1b[K")[1:]


def test_a_terminal_shows_a_bar_with_rate_and_time_left(monkeypatch):
    *_, half = _lines_at_terminal(monkeypatch, [(10.0, 0.0, True), (30.0, 0.5, True)])
    assert half.startswith(" 50 %  solving |███")
    assert half.endswith("|  2.50%/s, 00:20 left")  # 50 % in 20 s
    assert len(half) == 79


def test_a_job_after_another_has_a_rate_of_its_own(monkeypatch):
    calls = [(0.0, 0.0, True), (500.0, 1.0, True), (510.0, 0.0, True), (530.0, 0.5, True)]
    assert _lines_at_terminal(monkeypatch, calls)[-1].endswith("|  2.50%/s, 00:20 left")


def test_a_bar_whose_end_nobody_knows_tells_no_time_left(monkeypatch):
    *_, half = _lines_at_terminal(monkeypatch, [(10.0, 0.0, False), (30.0, 0.5, False)])
    assert half.startswith(" 50 %  solving |███")
    assert half.endswith("|")


@pytest.mark.parametrize("columns", [1, 12, 40, 200])
def test_a_bar_stays_on_one_line_of_a_terminal_of_any_width(monkeypatch, columns):
    lines = _lines_at_terminal(monkeypatch, [(10.0, 0.0, True), (30.0, 0.5, True)], columns)
    assert all(len(line) < max(columns, 2) for line in lines)


def test_a_terminal_without_blocks_gets_a_bar_of_plain_signs(monkeypatch):
    monkeypatch.setattr(_Terminal, "encoding", "ascii")
    assert _lines_at_terminal(monkeypatch, [(10.0, 0.0, True), (30.0, 0.5, True)])[-1].isascii()


def test_progress_elsewhere_is_a_plain_line_now_and_then(monkeypatch):
    speaker, _, err = console(as_json=False)
    now = [10.0]
    monkeypatch.setattr("daq_app.console.time.monotonic", lambda: now[0])
    for instant, part in ((10.0, 0.25), (11.0, 0.3), (12.5, 0.5)):
        now[0] = instant
        speaker.progress(part, "solving")
    assert err.getvalue() == " 25 %  solving\n 50 %  solving\n"


def test_work_whose_end_nobody_knows_shows_how_long_it_has_taken_and_can_still_be_left(monkeypatch):
    monkeypatch.setattr("daq_app.console._PATIENCE", 0.0)
    speaker, _, err = console(as_json=False)

    def work():
        with speaker.working("solving") as goes_on:
            assert goes_on(0.4)
            while "solving" not in err.getvalue():
                pass
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert "s so far; Ctrl-C stops" in err.getvalue()
    assert all(thread.name != "progress" for thread in threading.enumerate())


@pytest.mark.parametrize("text", ["-1e-3", "-.5e2", "-7"])
def test_a_negative_number_is_the_value_of_an_option(text):
    parser = Parser()
    parser.add_argument("--shift", type=float)
    assert parser.parse_args(["--shift", text]).shift == float(text)
