"""Experimenter and subject at a terminal: prompts on stderr, answers from stdin."""

import sys
import threading
from collections import deque
from typing import TextIO

from sessions.steps import (
    Abort,
    AskBegin,
    AskFinish,
    AskMount,
    AskScore,
    AskStroke,
    Begin,
    Command,
    EndSession,
    Event,
    Finish,
    MeasureZero,
    Pause,
    Redo,
    Refuse,
    Resume,
    Scored,
    ShowInstruction,
    Skip,
    StimulusMounted,
    StrokeDone,
    Tell,
)

HELP = (
    "Enter does what is asked. At any time: redo REASON, skip REASON, pause, resume, abort REASON. "
    "A score is a number from 0 to 100, or - for no answer."
)
WAYS = {1: "from proximal to distal (away from the subject)", -1: "from distal to proximal (towards the subject)"}


class Terminal:
    """Reads lines in a thread of its own, so that nobody's slowness holds up the recording."""

    def __init__(self, *, forces: bool, lines: TextIO | None = None, out: TextIO | None = None) -> None:
        """Talk on stderr and listen on stdin; `forces` is False where no transducer tells when a stroke is done."""
        self._forces = forces
        self._out = out or sys.stderr
        self._asked: Command | None = None
        self._lines: deque[str] = deque()
        self.closed = False  # nobody can type any more
        # A daemon: a blocked read of stdin must not keep the program alive.
        threading.Thread(target=self._read, args=(lines or sys.stdin,), daemon=True).start()
        self._print(HELP)

    def show(self, command: Command) -> None:
        """Print what is to be done, and remember what was asked."""
        match command:
            case AskBegin():
                self._ask(command, "Press Enter to begin.")
            case ShowInstruction(block):
                self._print(f"\n== {block.name}: {block.instruction}")
            case AskMount(trial):
                self._ask(command, f"Trial {trial.number}: mount {trial.stimulus.code}, then press Enter.")
            case MeasureZero():
                self._print("Zero is being measured: hands off.")
            case AskStroke(trial):
                after = "" if self._forces else " Press Enter when it is done."
                self._ask(command, f"Stroke once, {WAYS[trial.direction]}.{after}")
            case AskScore(_, (low, high)):
                self._ask(command, f"Score from 0 ({low}) to 100 ({high}):")
            case AskFinish():
                self._ask(command, "Every trial is done. Press Enter to end the session.")
            case Tell(sentence) | Refuse(sentence):
                self._print(sentence)
            case EndSession(reason):
                self._print(f"The session ends: {reason}.")
            case _:
                pass

    def poll(self) -> tuple[Event, ...]:
        """Return what the lines typed since the last call mean."""
        events = [self._meant(self._lines.popleft().strip()) for _ in range(len(self._lines))]
        return tuple(event for event in events if event is not None)

    def _meant(self, line: str) -> Event | None:
        word, _, rest = line.partition(" ")
        orders: dict[str, Event] = {
            "redo": Redo(rest),
            "skip": Skip(rest),
            "abort": Abort(rest),
            "pause": Pause(),
            "resume": Resume(),
        }
        if word in orders:
            return orders[word]
        match self._asked, line:
            case AskBegin(), "":
                return Begin()
            case AskMount(trial), "":
                return StimulusMounted(trial.stimulus.code)
            case AskStroke(), "" if not self._forces:
                return StrokeDone()
            case AskFinish(), "":
                return Finish()
            case AskScore(), "-":
                return Scored(None)
            case AskScore(), text if text.replace(".", "", 1).isdecimal():
                return Scored(float(text))
            case _:
                self._print(f"'{line}' means nothing now. {HELP}" if line else "Nothing is waiting for Enter now.")
                return None

    def _ask(self, command: Command, sentence: str) -> None:
        self._asked = command
        self._print(sentence)

    def _print(self, sentence: str) -> None:
        print(sentence, file=self._out, flush=True)

    def _read(self, lines: TextIO) -> None:
        for line in lines:
            self._lines.append(line)
        self.closed = True
