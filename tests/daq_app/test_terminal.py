"""A person at a terminal: what is typed there, and what becomes of a session when the terminal goes."""

import io
import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from desk import Desk

from daq_app.cli.main import run
from daq_app.cli.terminal import PERCEPTION, Terminal
from daq_app.console import Console, accept_any_text
from daq_app.recorder.client import Recorder
from daq_app.recorder.messages import SessionBegun, SessionEnded
from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording
from sessions.run import steps

TRIAL, NEXT = plan(protocol("sensotact-friction"), "S01", 3).trials[:2]
ENDS = ("not at all", "very")


def read_line(command, line, *, forces=True):
    """Return what a line means after a command, and what is said about it."""
    out = io.StringIO()
    terminal = Terminal(Console(as_json=False, err=out), forces=forces, lines=io.StringIO(f"{line}\n"))
    while not terminal.closed:
        time.sleep(0.001)
    terminal.show(command)
    return terminal.poll(), out.getvalue()


@pytest.mark.parametrize(
    ("command", "line", "event"),
    [
        (steps.AskMount(TRIAL), "", steps.StimulusMounted(TRIAL.stimulus.code)),
        (steps.AskScore(TRIAL, ENDS), "37.5", steps.Scored(37.5, input_device="keyboard")),
        (steps.AskScore(TRIAL, ENDS), "37,5", steps.Scored(37.5, input_device="keyboard")),
        (steps.AskScore(TRIAL, ENDS), "-", steps.Scored(None, input_device="keyboard")),
        (steps.AskScore(TRIAL, ENDS), "redo wrong finger", steps.Redo("wrong finger")),
        (steps.AskStroke(TRIAL), "abort ill", steps.Abort("ill")),
        (steps.AskStroke(TRIAL), "pause", steps.Pause()),
        (steps.AskStroke(TRIAL), "skip broken sample", steps.Skip("broken sample")),
        (steps.AskStroke(TRIAL), "undo", steps.UndoRedo()),
        (steps.AskStroke(TRIAL), "resume", steps.Resume()),
        (steps.AskNumber(TRIAL, "How rough?"), "12.5", steps.MagnitudeEstimate(12.5, input_device="keyboard")),
        (steps.AskChoice(TRIAL, NEXT, "Which?"), "1", steps.PairedChoice("first", input_device="keyboard")),
        (steps.AskChoice(TRIAL, NEXT, "Which?"), "2", steps.PairedChoice("second", input_device="keyboard")),
        (steps.AskChoice(TRIAL, NEXT, "Which?"), "-", steps.PairedChoice(None, input_device="keyboard")),
        (steps.AskRest(30.0), "", steps.Resume()),
        (steps.AskBegin(), "", steps.Begin()),
        (steps.AskFinish(), "", steps.Finish()),
    ],
)
def test_a_line_means_what_was_asked_for(command, line, event):
    assert read_line(command, line)[0] == (event,)


def test_a_choice_of_two_names_both_stimuli_and_takes_no_third():
    events, text = read_line(steps.AskChoice(TRIAL, NEXT, "Which?"), "3")
    assert events == ()
    sentence = f"Which? 1 for the first ({TRIAL.stimulus.code}), 2 for the second ({NEXT.stimulus.code}):"
    assert text.count(sentence) == 2


def test_a_number_that_may_be_a_thousand_is_asked_for_again():
    events, output = read_line(steps.AskNumber(TRIAL, "How rough?"), "1,000")
    assert events == ()
    assert "'1,000' is not valid now: it is 1000 or 1.000. How rough?" in output


def test_enter_reports_a_stroke_only_where_no_transducer_feels_it():
    assert read_line(steps.AskStroke(TRIAL), "", forces=False)[0] == (steps.StrokeDone(),)
    events, output = read_line(steps.AskStroke(TRIAL), "")
    assert events == ()
    assert "Nothing is waiting for Enter now" in output


@pytest.mark.parametrize("line", ["", "good", "1 0"])
def test_a_line_that_means_nothing_is_told_what_is_asked_for(line):
    events, text = read_line(steps.AskScore(TRIAL, ENDS), line)
    assert events == ()
    assert text.count(f"Score from 0 ({ENDS[0]}) to 100 ({ENDS[1]}):") == 2  # as asked, and once more


def test_a_pause_is_reported_once_with_how_it_ends_and_enter_does_nothing_meanwhile():
    out = io.StringIO()
    terminal = Terminal(Console(as_json=False, err=out), forces=False, lines=io.StringIO("\n"))
    while not terminal.closed:
        time.sleep(0.001)
    terminal.show(steps.AskStroke(TRIAL))
    for state in ("ready", "paused", "paused"):
        terminal.follow(state)
    paused = "The session is paused. Type resume to continue."
    assert out.getvalue().count(paused) == 1
    assert terminal.poll() == ()
    assert out.getvalue().endswith(f"Nothing is waiting for Enter now. {paused}\n")


def test_a_session_is_ended_for_good_only_with_a_reason():
    events, text = read_line(steps.AskStroke(TRIAL), "abort ")
    assert events == ()
    assert "say why: abort needs a reason" in text


def test_a_note_in_another_encoding_than_the_terminals_is_kept_with_escapes_and_the_next_line_is_heard():
    lines = io.TextIOWrapper(io.BytesIO("note müde\npause\n".encode("latin-1")), encoding="utf-8")
    accept_any_text(lines)
    terminal = Terminal(Console(as_json=False, err=io.StringIO()), forces=True, lines=lines)
    while not terminal.closed:
        time.sleep(0.001)
    assert terminal.poll() == (steps.Note(r"m\xfcde"), steps.Pause())


def test_who_goes_on_at_a_terminal_with_a_session_of_the_window_can_type_there(tmp_path):
    folder = tmp_path / "P07"
    with Recorder.start() as recorder:
        desk = Desk(recorder, {steps.AskMount: lambda _: recorder.leave()})
        desk.begin(folder, people="simulated hand")
        desk.until(SessionEnded)
    words = [sys.executable, "-m", "daq_app", "resume", str(folder)]
    process = subprocess.run(words, input="", capture_output=True, text=True, check=False)
    assert "Enter does what is asked" in process.stderr


@pytest.fixture
def at_a_terminal(tmp_path):
    """A session on the simulated bench whose people are at a terminal; it waits for the first stimulus."""
    folder = tmp_path / "s"
    words = ["run", "sensotact-friction", "--device", "sim:", "--subject", "P01", "--out", str(folder)]
    process = subprocess.Popen(
        [sys.executable, "-m", "daq_app", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        process_group=0,
    )
    output = ""
    for prompt in ("Press Enter to begin.", "press Enter."):
        while prompt not in output:
            letter = process.stderr.read(1)
            assert letter, output
            output += letter
        process.stdin.write("\n" * prompt.endswith("begin."))
        process.stdin.flush()
    yield folder, process
    process.kill()
    process.communicate()


@pytest.mark.skipif(os.name != "posix", reason="signals a group of processes")
def test_ctrl_c_at_the_terminal_ends_and_seals_the_session(at_a_terminal):
    folder, process = at_a_terminal
    os.killpg(process.pid, signal.SIGINT)
    out, output = process.communicate()
    assert process.returncode == 3
    assert re.search(r"stopping\n(.*\n)*sealing", output)
    assert "stopped by the user" in out
    assert (folder / "MANIFEST.json").exists()
    assert Recording.open(folder).end["cause"] == "stopped"


def test_a_terminal_that_closes_leaves_a_session_that_can_be_resumed(at_a_terminal):
    folder, process = at_a_terminal
    out, output = process.communicate()  # closes its stdin
    assert process.returncode == 3
    assert "is gone" in out
    assert "daq-app resume" in output
    assert Recording.open(folder).end["cause"] == "client"


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="finds the recorder's process as Linux tells of it")
def test_a_second_ctrl_c_leaves_a_recorder_that_does_not_answer_and_it_ends_the_session_when_it_wakes(at_a_terminal):
    folder, process = at_a_terminal
    recorder = int(Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()[0])
    os.kill(recorder, signal.SIGSTOP)
    os.killpg(process.pid, signal.SIGINT)
    output = ""
    while "stopping" not in output:
        output += process.stderr.read(1)
    os.killpg(process.pid, signal.SIGINT)
    _, output = process.communicate()
    assert process.returncode == 3
    assert f"on its own, in {folder}\n" in output
    assert Recording.open(folder).end is None
    os.kill(recorder, signal.SIGCONT)
    while not (folder / "MANIFEST.json").exists():
        time.sleep(0.05)
    assert Recording.open(folder).end["cause"] == "stopped"


def test_the_last_line_before_a_terminal_closes_is_heard(tmp_path):
    folder = tmp_path / "s"
    words = ["run", "sensotact-friction", "--scores-only", "--subject", "P01", "--out", str(folder)]
    words = [sys.executable, "-m", "daq_app", *words]
    process = subprocess.run(words, input="note seen\nabort ill\n", capture_output=True, text=True, check=False)
    assert process.returncode == 3, process.stderr
    assert [event.data.get("text") for event in Recording.open(folder).events if event.kind == "note"] == ["seen"]
    assert Recording.open(folder).end["reason"] == "ill"


@pytest.mark.skipif(os.name != "posix", reason="kill -9 needs POSIX")
def test_a_script_gets_a_document_of_a_session_whose_recorder_is_killed_at_its_beginning_and_after_it_is_resumed(
    tmp_path, capsys, monkeypatch
):
    poll = Recorder.poll

    def poll_and_kill(recorder, timeout=0.0):
        reports = poll(recorder, timeout)
        if any(isinstance(report, SessionBegun) for report in reports):
            recorder.kill()
        return reports

    monkeypatch.setattr(Recorder, "poll", poll_and_kill)
    folder = tmp_path / "P07"
    people = ("--headless", "--simulate-subject", "7", "--json")
    begin = ("run", "sensotact-friction", "--scores-only", "--subject", "P07", "--seed", "7", "--out", str(folder))
    for command, further in ((begin, {"seed": 7}), (("resume", str(folder)), {"gap": None})):
        assert run([*command, *people]) == 3
        output = capsys.readouterr()
        document = json.loads(output.out)
        error = document.pop("error")
        document.update(dict.fromkeys({"gap"} & set(document)))  # whether it is written already, and how long
        assert document == {"session": str(folder), "end": None, "sealed": False, **further}
        assert error["kind"] == "recorder"
        assert f"with 'daq-app resume {folder}'" in error["message"]
        assert f"daq-app: {error['message']}" in output.err


def test_an_enter_of_a_person_that_came_before_the_question_could_be_read_does_not_confirm_it(monkeypatch):
    """As when a rest ends by itself just as Enter is pressed to end it."""

    class Keys(io.StringIO):
        def isatty(self):
            return True

    events = []
    for wait in (0.0, 2.0 * PERCEPTION):
        now = time.monotonic()
        monkeypatch.setattr("daq_app.cli.terminal.time", SimpleNamespace(monotonic=lambda now=now: now))
        out = io.StringIO()
        terminal = Terminal(Console(as_json=False, err=out), forces=True, lines=Keys())
        terminal.show(steps.AskMount(TRIAL))
        terminal._lines.append((now + wait, ""))
        events += terminal.poll()
        question = f"Trial 1: mount {TRIAL.stimulus.code}, then press Enter.\n"
        repetition = f"That Enter came too soon after this was asked. {question}"
        assert out.getvalue().endswith(question if wait else f"{question}{repetition}")
    assert events == [steps.StimulusMounted(TRIAL.stimulus.code)]
