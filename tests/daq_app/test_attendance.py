"""A session attended at a terminal: how it comes out, and what is said while it runs, from a scripted recorder."""

import io

import pytest
from recordings import PLAN

from daq_app.cli.terminal import attend_session, open_device
from daq_app.console import Console, RecordingKept, WrongValue
from daq_app.recorder import messages as m
from drivers.transducer import Health, LinkLost, SetupError
from sessions.recording import RecordingError
from sessions.run.runner import SessionEnd

BEGUN = m.SessionBegun("here", PLAN, "simulated people", None, 0)


class ScriptedRecorder:
    """Gives one batch of reports a look, and for each says for how long it has been silent [s]."""

    def __init__(self, *batches):
        self.batches, self.sent, self.silence = list(batches), [], 0.0
        self.send = self.sent.append

    def poll(self, _):
        reports, self.silence = self.batches.pop(0)
        return reports


def ended(*, complete=True, resumable=False, **counts):
    return m.SessionEnded("here", SessionEnd("every trial is done", "plan", complete, 100, Health(**counts)), resumable)


def attend(*batches):
    out = io.StringIO()
    request = m.ResumeSession("here")
    return attend_session(ScriptedRecorder(*batches), request, Console(as_json=False, err=out)), out.getvalue()


@pytest.mark.parametrize(
    ("end", "code"),
    [
        (ended(received=100), 0),
        (ended(complete=False), 3),
        (ended(lost=1), 3),
        (ended(doubtful=1), 3),
        (ended(off_units=1), 3),
    ],
)
def test_a_sealed_session_is_done_unless_trials_are_missing_or_readings_are_lost_or_in_doubt(end, code):
    outcome, output = attend(([BEGUN], 0.0), ([end, m.Sealing("here")], 0.0), ([m.Sealed("here")], 0.0))
    assert (outcome.exit_code, outcome.sealed, outcome.folder) == (code, True, "here")
    assert "sealing here" in output


def test_a_session_that_can_go_on_is_left_unsealed():
    outcome, _ = attend(([BEGUN], 0.0), ([ended(complete=False, resumable=True)], 0.0))
    assert (outcome.exit_code, outcome.sealed) == (3, False)


def test_a_recorder_that_does_not_answer_is_wondered_about_once_and_greeted_once():
    silent = [([], silence) for silence in (2.9, 3.1, 9.0, 0.0, 0.1)]
    _, output = attend(([], 9.0), ([BEGUN], 0.0), *silent, ([ended()], 9.0), ([m.Sealed("here")], 0.0))
    assert [line for line in output.splitlines() if "recorder" in line] == [
        "the recorder has not answered for 3 s: the computer is busy, or its disk does not answer",
        "the recorder answers again",
    ]


@pytest.mark.parametrize(
    ("report", "error"),
    [
        (m.Failed("Connect", "no such address", "AddressError"), WrongValue),
        (m.Failed("Connect", "not now", "NotNow"), WrongValue),
        (m.Failed("Connect", "gone", "LinkLost"), LinkLost),
        (m.Failed("Connect", "in use", "SetupError"), SetupError),
        (m.Failed("Connect", "the disk is full", "OSError"), RecordingError),
        (m.Gone(False, "the recorder has ended"), RecordingError),
    ],
)
def test_a_failure_of_the_recorder_is_that_of_the_command_line(report, error):
    sentence = report.sentence
    with pytest.raises(error, match=sentence):
        open_device(ScriptedRecorder(([report], 0.0)), "sim:")
    with pytest.raises(error, match=sentence):
        attend(([report], 0.0))


def test_a_recorder_or_a_disk_that_fails_during_a_session_keeps_what_was_recorded():
    with pytest.raises(RecordingKept, match="resume the session, with 'daq-app resume here'"):
        attend(([BEGUN], 0.0), ([m.Gone(False, "resume the session")], 0.0))
    with pytest.raises(RecordingKept, match="the disk took no more"):
        attend(([BEGUN], 0.0), ([m.Failed("StartSession", "the disk took no more", "DiskRefused")], 0.0))
