"""A session run by the recorder and attended from a terminal: what `run` and `resume` share."""

from dataclasses import dataclass

from daq_app.cli.terminal import Terminal
from daq_app.console import DONE, FLAWED, Console, WrongValue
from daq_app.recorder import messages as m
from daq_app.recorder.client import Recorder
from drivers.transducer import LinkLost, SetupError
from sessions.recording import RecordingError
from sessions.run.interruptions import Interruptions, interruptions
from sessions.run.runner import SessionEnd, Status
from sessions.run.steps import Command

SILENCE = 3.0  # after which a recorder that should answer four times a second is wondered about [s]
LOOK = 0.02  # between two looks at recorder, terminal and Ctrl-C [s]
_WRONG = frozenset({"AddressError", "NotNow"})  # failures that come of the command line


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a session came out."""

    folder: str  # where it lies: another folder than asked for where that was taken away meanwhile
    end: SessionEnd
    sealed: bool

    @property
    def exit_code(self) -> int:
        """Return DONE for a session with every trial and no flaw of its transducer, else FLAWED."""
        health = self.end.health
        return DONE if self.end.complete and not (health.lost or health.doubtful or health.off_units) else FLAWED


def open_device(recorder: Recorder, uri: str) -> m.Device:
    """Have the recorder open a transducer. Raises as the driver does, KeyboardInterrupt when somebody stops it."""
    with interruptions() as interrupted:
        recorder.send(m.Connect(uri))
        while True:
            for report in recorder.poll(LOOK):
                if isinstance(report, m.Device):
                    return report
                _raise_failure(report)
            if interrupted.heard:
                recorder.send(m.Stop())
                raise KeyboardInterrupt


def attend_session(recorder: Recorder, request: m.StartSession | m.ResumeSession, console: Console) -> Outcome:
    """Attend a session until it is sealed, or cut short; people answer at this terminal unless they are simulated.

    A stop is passed on at once; a second one no longer waits: for the sealing, which the recorder finishes alone, or
    for a recorder that does not answer (KeyboardInterrupt). Raises as a driver does, RecordingError, WrongValue.
    """
    recorder.send(request)
    with interruptions() as interrupted:
        return _Attendance(recorder, console, interrupted).to_the_end()


class _Attendance:
    """What changes while a session is attended."""

    def __init__(self, recorder: Recorder, console: Console, interrupted: Interruptions) -> None:
        self._recorder = recorder
        self._console = console
        self._interrupted = interrupted
        self._terminal: Terminal | None = None
        self._begun: m.SessionBegun | None = None
        self._folder = ""
        self._end: SessionEnd | None = None
        self._stopping = False
        self._silent = False

    def to_the_end(self) -> Outcome:
        while True:
            for report in self._recorder.poll(LOOK):
                if (outcome := self._take(report)) is not None:
                    return outcome
            if self._interrupted.heard:
                self._interrupted.heard = False
                if self._end is not None:
                    self._console.note("the recorder goes on sealing the session by itself")
                    return Outcome(self._folder, self._end, sealed=False)
                if self._stopping:
                    raise KeyboardInterrupt
                self._stopping = True
                self._console.note("stopping")
                self._recorder.send(m.Stop())
            self._watch_silence()
            if self._terminal is not None:
                for event in self._terminal.poll():
                    self._recorder.send(event)
                if self._terminal.closed and self._end is None:
                    self._terminal = None
                    self._recorder.leave()

    def _watch_silence(self) -> None:
        """Say so once where the recorder does not answer, and once when it does again."""
        running = self._begun is not None and self._end is None  # it is silent while it starts, and while it seals
        silent = running and self._recorder.silence > SILENCE
        if silent != self._silent:
            self._silent = silent
            self._console.note(
                f"the recorder has not answered for {SILENCE:g} s: the computer is busy, or its disk does not answer"
                if silent
                else "the recorder answers again"
            )

    def _take(self, report: m.Report) -> Outcome | None:
        """Take a report, and return the outcome when it is the last."""
        match report:
            case m.SessionBegun():
                self._begin(report)
            case Status():
                self._show_status(report)
            case m.SessionEnded(folder, end, resumable):
                self._folder, self._end = folder, end
                self._terminal = None
                return Outcome(folder, end, sealed=False) if resumable else None
            case m.Sealing(folder):
                self._console.note(f"sealing {folder}")
            case m.Sealed():
                assert self._end is not None
                return Outcome(self._folder, self._end, sealed=True)
            case m.LinkDown(sentence) if self._begun is None:
                raise LinkLost(sentence)  # it was opened, and does not stream
            case m.Failed() if self._stopping and self._begun is None:
                raise KeyboardInterrupt  # as wanted, before anything was recorded
            case m.Failed() | m.Gone():
                _raise_failure(report)
            case _ if isinstance(report, Command) and self._terminal is not None:
                self._terminal.show(report)
            case _:
                pass
        return None

    def _begin(self, begun: m.SessionBegun) -> None:
        self._begun = begun
        if begun.people == "people":
            self._terminal = Terminal(forces=begun.plan.forces)

    def _show_status(self, status: Status) -> None:
        if self._terminal is None and self._begun is not None:
            done = 0.0 if status.trial is None else (status.trial - 1) / status.trials
            who = self._begun.plan.subject
            self._console.progress(done, f"{who}: {status.state}, {status.safe.readings} readings safe")


def _raise_failure(report: m.Report) -> None:
    """Raise what a report tells of as the command line tells it."""
    match report:
        case m.Failed(_, sentence, kind):
            if kind in _WRONG:
                raise WrongValue(sentence)
            raise {"LinkLost": LinkLost, "SetupError": SetupError}.get(kind, RecordingError)(sentence)
        case m.Gone(_, sentence):
            raise RecordingError(sentence)
        case _:
            pass
