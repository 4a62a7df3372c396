"""Experimenter and subject at a terminal: prompts on stderr, answers from stdin."""

import sys
import threading
from collections import deque
from typing import Literal, TextIO

from sessions.plan.plan import Trial
from sessions.run import steps

HELP = (
    "Enter does what is asked. At any time: redo REASON, skip REASON, pause, resume, note TEXT, abort REASON; "
    "undo, of a redo, until the next stroke. "
    "An answer is a number, or 1 or 2 for the first or second of two, or - for no answer."
)
KEYBOARD = "keyboard"
CHOICES: dict[float, Literal["first", "second"]] = {1.0: "first", 2.0: "second"}
WAYS = {1: "from proximal to distal (away from the subject)", -1: "from distal to proximal (towards the subject)"}


class Terminal:
    """Reads lines in a thread of its own, so that nobody's slowness holds up the recording."""

    def __init__(self, *, forces: bool, lines: TextIO | None = None, out: TextIO | None = None) -> None:
        """Talk on stderr and listen on stdin; `forces` is False where no transducer tells when a stroke is done."""
        self._forces = forces
        self._out = out or sys.stderr
        self._command: steps.Command | None = None
        self._lines: deque[str] = deque()
        self.closed = False  # nobody can type any more
        # A daemon: a blocked read of stdin must not keep the program alive.
        threading.Thread(target=self._read, args=(lines or sys.stdin,), daemon=True).start()
        self._print(HELP)

    def show(self, command: steps.Command) -> None:
        """Print what is to be done, and remember what was asked."""
        question = self._question(command)
        if question is not None:
            self._command = command
            self._print(question)
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
            case _:
                pass

    def _question(self, command: steps.Command) -> str | None:
        """Return what a command asks for in words; None for one that asks for nothing."""
        match command:
            case steps.AskBegin():
                return "Press Enter to begin."
            case steps.AskMount(trial):
                return f"{_called(trial)}: mount {trial.stimulus.code}, then press Enter."
            case steps.AskStroke(trial, allowed):
                after = "" if self._forces else " Press Enter when it is done."
                often = "once" if allowed == 1 else f"up to {allowed} times"
                return f"Stroke {often}, {WAYS[trial.direction]}.{after}"
            case steps.AskScore(_, (low, high), question=question):
                return f"{question} Score from 0 ({low}) to 100 ({high}):".strip()
            case steps.AskNumber(_, question):
                return f"{question} A number above 0, on the subject's own scale:"
            case steps.AskChoice(first, second, question):
                which = f"1 for the first ({first.stimulus.code}), 2 for the second ({second.stimulus.code}):"
                return f"{question} {which}"
            case steps.AskRest(duration):
                long = "" if duration is None else f" It goes on by itself after {duration:g} s."
                return f"The subject rests. Press Enter to go on.{long}"
            case steps.AskFinish():
                return "Every trial is done. Press Enter to end the session."
            case _:
                return None

    def poll(self) -> tuple[steps.Event, ...]:
        """Return what the lines typed since the last call mean."""
        events = [self._meant(self._lines.popleft().strip()) for _ in range(len(self._lines))]
        return tuple(event for event in events if event is not None)

    def _meant(self, line: str) -> steps.Event | None:
        word, _, rest = line.partition(" ")
        orders: dict[str, steps.Event] = {
            "redo": steps.Redo(rest),
            "undo": steps.UndoRedo(),
            "skip": steps.Skip(rest),
            "abort": steps.Abort(rest),
            "note": steps.Note(rest),
            "pause": steps.Pause(),
            "resume": steps.Resume(),
        }
        if word in orders:
            return orders[word]
        event = self._done() if line == "" else self._answered(line)
        if event is None:
            self._print(f"'{line}' means nothing now. {HELP}" if line else "Nothing is waiting for Enter now.")
        return event

    def _done(self) -> steps.Event | None:
        """Return what Enter alone means."""
        match self._command:
            case steps.AskBegin():
                return steps.Begin()
            case steps.AskMount(trial):
                return steps.StimulusMounted(trial.stimulus.code)
            case steps.AskStroke() if not self._forces:
                return steps.StrokeDone()
            case steps.AskRest():
                return steps.Resume()
            case steps.AskFinish():
                return steps.Finish()
            case _:
                return None

    def _answered(self, line: str) -> steps.Event | None:
        """Return the answer that was typed; what a keyboard cannot tell stays open."""
        number = float(line) if line.replace(".", "", 1).isdecimal() else None
        if number is None and line != "-":
            return None
        match self._command:
            case steps.AskScore():
                return steps.Scored(number, input_device=KEYBOARD)
            case steps.AskNumber():
                return steps.MagnitudeEstimate(number, input_device=KEYBOARD)
            case steps.AskChoice() if number is None or number in CHOICES:
                return steps.PairedChoice(None if number is None else CHOICES[number], input_device=KEYBOARD)
            case _:
                return None

    def _print(self, sentence: str) -> None:
        print(sentence, file=self._out, flush=True)

    def _read(self, lines: TextIO) -> None:
        for line in lines:
            self._lines.append(line)
        self.closed = True


def _called(trial: Trial) -> str:
    """Return how a trial is announced."""
    kind = "Trial" if trial.phase == "main" else trial.phase.capitalize() + " trial"
    return f"{kind} {trial.number}"
