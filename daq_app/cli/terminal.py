"""A terminal that attends a session of the recorder: prompts on stderr, answers from stdin."""

import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal, Never, TextIO

from daq_app.console import DONE, FLAWED, Console, RecordingKept, WrongValue
from daq_app.recorder import messages as m
from daq_app.recorder.client import Recorder
from daq_app.wording import two_meanings, typed_number
from drivers.transducer import LinkLost, SetupError
from sessions.recording import RecordingError
from sessions.run import steps
from sessions.run.interruptions import Interruptions, interruptions
from sessions.run.runner import SessionEnd, Status
from sessions.run.steps import Command

_HELP = (
    "Enter does what is asked. At any time: redo REASON, skip REASON, pause, resume, note TEXT, abort REASON; "
    "undo, of a redo, until the next stroke. "
    "An answer is a number, or 1 or 2 for the first or second of two, or - for no answer."
)
PAUSED = "The session is paused. Type resume to continue."
KEYBOARD = "keyboard"
# A person's Enter that comes sooner after a question was meant for the one before [s]. The window waits as long: Qt's
# default for a double click.
PERCEPTION = 0.4
_CHOICES: dict[float | None, Literal["first", "second"] | None] = {1.0: "first", 2.0: "second", None: None}
_WAYS = {1: "from proximal to distal (away from the subject)", -1: "from distal to proximal (towards the subject)"}


@dataclass(frozen=True, slots=True)
class Prompt:
    """The text of a prompt, and the events of Enter alone and of a number (None: no answer)."""

    question: str
    enter: steps.Event | None = None
    answer: Callable[[float | None], steps.Event | None] = lambda _: None


class Terminal:
    """Reads lines in a separate thread, so that slow typing does not hold up the recording."""

    def __init__(self, console: Console, *, forces: bool, lines: TextIO | None = None) -> None:
        """Write to stderr and read stdin; `forces` is False if no transducer detects the end of a stroke."""
        self._forces = forces
        self._print = console.note
        self._prompt: Prompt | None = None
        self._asked_at = 0.0  # when the prompt was shown [s]
        self._paused = False
        self._source = lines or sys.stdin
        self._lines: deque[tuple[float, str]] = deque()  # with the time [s] at which each came
        self.closed = False  # stdin has ended
        # A daemon: a blocked read of stdin must not keep the program alive.
        threading.Thread(target=self._read, daemon=True).start()
        self._print(_HELP)

    def show(self, command: steps.Command) -> None:
        """Print the instruction of a command, and remember its question."""
        if (prompt := self._prompt_of(command)) is not None:
            self._prompt, self._asked_at = prompt, time.monotonic()
            self._print(prompt.question)
            return
        match command:
            case steps.ShowInstruction(block):
                self._print(f"\n== {block.name}: {block.instruction}")
            case steps.MeasureZero():
                self._print("Zero is being measured: hands off.")
            case steps.Tell(sentence) | steps.Refuse(sentence):
                self._print(sentence)
            case steps.EndSession(reason):
                self._print(f"The session ends: {reason}.")

    def follow(self, state: str) -> None:
        """Announce a pause once when it begins."""
        was_paused, self._paused = self._paused, state == "paused"
        if self._paused and not was_paused:
            self._print(PAUSED)

    def _prompt_of(self, command: steps.Command) -> Prompt | None:
        match command:
            case steps.AskBegin():
                return Prompt("Press Enter to begin.", steps.Begin())
            case steps.AskMount(trial):
                name = "Trial" if trial.phase == "main" else trial.phase.capitalize() + " trial"
                code = trial.stimulus.code
                return Prompt(f"{name} {trial.number}: mount {code}, then press Enter.", steps.StimulusMounted(code))
            case steps.AskStroke(trial, allowed):
                often = "once" if allowed == 1 else f"up to {allowed} times"
                stroke = f"Stroke {often}, {_WAYS[trial.direction]}."
                with_key = Prompt(f"{stroke} Press Enter when it is done.", steps.StrokeDone())
                return Prompt(stroke) if self._forces else with_key
            case steps.AskScore(_, (low, high), question=question):
                text = f"{question} Score from 0 ({low}) to 100 ({high}):".strip()
                return Prompt(text, answer=lambda number: steps.Scored(number, input_device=KEYBOARD))
            case steps.AskNumber(_, question):
                text = f"{question} A number above 0, on the subject's own scale:"
                return Prompt(text, answer=lambda number: steps.MagnitudeEstimate(number, input_device=KEYBOARD))
            case steps.AskChoice(first, second, question):
                choices = f"1 for the first ({first.stimulus.code}), 2 for the second ({second.stimulus.code}):"
                return Prompt(f"{question} {choices}", answer=_choice)
            case steps.AskRest(duration):
                long = "" if duration is None else f" It continues automatically after {duration:g} s."
                return Prompt(f"The subject rests. Press Enter to continue.{long}", steps.Resume())
            case steps.AskFinish():
                return Prompt("Every trial is done. Press Enter to end the session.", steps.Finish())
            case _:
                return None

    def poll(self) -> tuple[steps.Event, ...]:
        """Return the events of the lines typed since the last call."""
        events = [self._parse(*self._lines.popleft()) for _ in range(len(self._lines))]
        return tuple(event for event in events if event is not None)

    def _parse(self, arrival: float, line: str) -> steps.Event | None:
        word, _, text = line.partition(" ")
        orders: dict[str, steps.Event] = {
            "redo": steps.Redo(text), "skip": steps.Skip(text), "abort": steps.Abort(text), "note": steps.Note(text),
            "undo": steps.UndoRedo(), "pause": steps.Pause(), "resume": steps.Resume(),
        }  # fmt: skip
        if word == "abort" and not text.strip():  # it seals the session for good
            self._print("say why: abort needs a reason")
            return None
        if word in orders:
            return orders[word]
        event, number, early = None, typed_number(line), False
        if self._prompt is not None and line == "":
            early = arrival < self._asked_at + PERCEPTION and self._source.isatty()  # a script need not read
            event = None if self._paused or early else self._prompt.enter
        elif self._prompt is not None and (number is not None or line == "-"):
            event = self._prompt.answer(number)
        if event is None:
            due = PAUSED if self._paused else _HELP if self._prompt is None else self._prompt.question
            why = "That Enter came too soon after this was asked" if early else "Nothing is waiting for Enter now"
            nothing = f"'{line}' is not valid now" if line else why
            doubt = ": it is {} or {}".format(*meanings) if (meanings := two_meanings(line)) else ""
            self._print(f"{nothing}{doubt}. {due}")
        return event

    def _read(self) -> None:
        for line in self._source:
            self._lines.append((time.monotonic(), line.strip()))
        self.closed = True


def _choice(number: float | None) -> steps.Event | None:
    """Return the event of choice 1, choice 2 or no answer (None); None for any other number."""
    return steps.PairedChoice(_CHOICES[number], input_device=KEYBOARD) if number in _CHOICES else None


SILENCE = 3.0  # without a report from the recorder, before the terminal says so [s]
_LOOK = 0.02  # between two polls of recorder, terminal and Ctrl-C [s]
# Of a failure by the kind that the recorder names; others are RecordingError.
_FAILURES: Mapping[str, type[Exception]] = {
    "AddressError": WrongValue, "NotNow": WrongValue, "LinkLost": LinkLost, "SetupError": SetupError,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Outcome:
    """The outcome of a session."""

    folder: str  # its final folder; not the requested one if that was removed during the session
    end: SessionEnd
    sealed: bool

    @property
    def exit_code(self) -> int:
        """Return DONE for a complete session without transducer flaws, else FLAWED."""
        health = self.end.health
        return DONE if self.end.complete and not (health.lost or health.doubtful or health.off_units) else FLAWED


def open_device(recorder: Recorder, uri: str) -> m.Device:
    """Have the recorder open a transducer. Raises as the driver does, and KeyboardInterrupt on a stop."""
    with interruptions() as interrupted:
        recorder.send(m.Connect(uri))
        while True:
            for report in recorder.poll(_LOOK):
                if isinstance(report, m.Device):
                    return report
                _raise_failure(report)
            if interrupted.pending:
                recorder.send(m.Stop())
                raise KeyboardInterrupt


def attend_session(recorder: Recorder, request: m.StartSession | m.ResumeSession, console: Console) -> Outcome:
    """Attend a session until it is sealed or cut short; people answer at this terminal unless they are simulated.

    A stop is passed on immediately. A second one ends the wait for the sealing, which the recorder finishes alone, or
    for a recorder that does not answer (RecordingKept). Raises RecordingKept too if recorder or disk fail during the
    session, and as a driver does, RecordingError, WrongValue.
    """
    recorder.send(request)
    with interruptions() as interrupted:
        return _Attendance(recorder, console, interrupted).to_the_end()


@contextmanager
def further_keys(keys: Callable[[], Mapping[str, object]]) -> Generator[None]:
    """Add a verb's own keys to the document of a session that cannot be followed further."""
    try:
        yield
    except RecordingKept as ending:
        ending.document |= keys()
        raise


class _Attendance:
    def __init__(self, recorder: Recorder, console: Console, interrupted: Interruptions) -> None:
        self._recorder = recorder
        self._console = console
        self._interrupted = interrupted
        self._terminal: Terminal | None = None
        self._start: m.SessionBegun | None = None
        self._end: m.SessionEnded | None = None
        self._stopping = False
        self._silent = False

    def to_the_end(self) -> Outcome:
        while True:
            for report in self._recorder.poll(_LOOK):
                if (outcome := self._take(report)) is not None:
                    return outcome
            if self._interrupted.pending:
                self._interrupted.pending = False
                if self._end is not None:
                    self._console.note("the recorder continues to seal the session")
                    return Outcome(self._end.folder, self._end.end, sealed=False)
                if self._stopping:
                    self._leave_silent_recorder()
                self._stopping = True
                self._console.note("stopping")
                self._recorder.send(m.Stop())
            self._watch_silence()
            if self._terminal is not None:
                closed = self._terminal.closed  # read first, so that the last line is polled too
                for event in self._terminal.poll():
                    self._recorder.send(event)
                if closed and self._end is None:
                    self._terminal = None
                    self._recorder.leave()

    def _leave_silent_recorder(self) -> Never:
        if self._start is None:
            raise KeyboardInterrupt
        sentence = "stopped; the recorder does not answer and will end the session on its own, in "
        raise _not_followed(f"{sentence}{self._start.folder}", "stopped", self._start.folder)

    def _watch_silence(self) -> None:
        """Report once when the recorder stops answering, and once when it answers again."""
        running = self._start is not None and self._end is None  # it is silent while it starts or seals
        previous, self._silent = self._silent, running and self._recorder.silence > SILENCE
        if self._silent != previous:
            doubt = f"has not answered for {SILENCE:g} s: the computer is busy, or its disk does not answer"
            self._console.note(f"the recorder {doubt if self._silent else 'answers again'}")

    def _take(self, report: m.Report) -> Outcome | None:
        """Take a report, and return the outcome if it is the last one."""
        match report:
            case m.SessionBegun():
                self._start = report
                attended, forces = report.people != "simulated people", report.plan.forces
                self._terminal = Terminal(self._console, forces=forces) if attended else None
            case Status():
                self._show_status(report)
            case m.SessionEnded(folder, end, resumable):
                self._end, self._terminal = report, None
                return Outcome(folder, end, sealed=False) if resumable else None
            case m.Sealing(folder):
                self._console.note(f"sealing {folder}")
            case m.Sealed():
                assert self._end is not None
                return Outcome(self._end.folder, self._end.end, sealed=True)
            case m.LinkDown(sentence) if self._start is None:
                raise LinkLost(sentence)  # it opened but does not stream
            case m.Failed() if self._stopping and self._start is None:
                raise KeyboardInterrupt  # as requested, before anything was recorded
            case m.Failed() | m.Gone():
                _raise_failure(report, "" if self._start is None else self._start.folder)
            case _ if isinstance(report, Command) and self._terminal is not None:
                self._terminal.show(report)
        return None

    def _show_status(self, status: Status) -> None:
        if self._terminal is not None:
            self._terminal.follow(status.state)
        elif self._start is not None:
            fraction = 0.0 if status.trial is None else (status.trial - 1) / status.trials
            subject = self._start.plan.subject
            self._console.progress(fraction, f"{subject}: {status.state}, {status.safe.readings} readings safe")


def _raise_failure(report: m.Report, folder: str = "") -> None:
    """Raise the failure in a report, of a session in `folder` if any, as the command line expects it."""
    match report:
        case m.Failed(_, sentence, "DiskRefused") if folder:
            raise _not_followed(sentence, "disk", folder)
        case m.Failed(_, sentence, kind):
            raise _FAILURES.get(kind, RecordingError)(sentence)
        case m.Gone(_, sentence):
            if not folder:
                raise RecordingError(sentence)
            raise _not_followed(f"{sentence}, with 'daq-app resume {folder}'", "recorder", folder)


def _not_followed(sentence: str, kind: str, folder: str) -> RecordingKept:
    """Return the end of a session that cannot be followed further, with the keys of one that can."""
    return RecordingKept(sentence, kind, session=folder, end=None, sealed=False)
