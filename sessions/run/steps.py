"""Events and commands of a session, and the answers of a subject, all plain data."""

import math
from itertools import pairwise

from msgspec import Struct

from sessions.plan.plan import Answer, Block, Choice, Hand, Trial

# ---- events


class Begin(Struct, frozen=True):
    """The experimenter begins the session."""


class StimulusMounted(Struct, frozen=True):
    """The experimenter has put a stimulus on."""

    code: str  # as read off its back


class Zeroed(Struct, frozen=True):
    """An unloaded stretch of readings was measured. The readings themselves are never altered."""

    mean: tuple[float, ...] = ()  # (6,) raw units
    spread: tuple[float, ...] = ()  # (6,) standard deviation, raw units
    readings: int = 0  # in the stretch
    duration: float = 0.0  # [s]
    first_sequence: int = 0  # record number of its first reading
    last_sequence: int = 0
    normal_force: float = 0.0  # mean of N as the calibration gives it, nothing subtracted [N]
    noise: float = 0.0  # standard deviation of N [N]


class _Detection(Struct, frozen=True):
    """The live detector saw something in the readings."""

    time: float = 0.0  # [s, device time]
    noticed: float = 0.0  # reading at which it was certain [s, device time]


class ContactOnset(_Detection, frozen=True):
    """The live detector saw the finger touch."""


class FingerLifted(_Detection, frozen=True):
    """The live detector saw the finger leave."""


class Settled(Struct, frozen=True):
    """The finger has been off for a moment since the last lift, so that the take may end."""

    time: float = 0.0  # of the reading at which this was certain [s, device time]


class StrokeDone(Struct, frozen=True):
    """The experimenter says that the stroke is done, in a visit without a transducer."""


class Scored(Struct, frozen=True):
    """The subject has judged on the line. What an input device does not report is empty or None."""

    score: float | None  # 0 to 100; None: the subject gave no answer
    positions: tuple[tuple[float, float], ...] = ()  # each one on the line: (session clock [s], 0 to 100), in order
    first_touch: float | None = None  # session clock [s]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Hand | None = None  # that answered
    input_device: str | None = None  # such as a pen, a finger on the screen


class MagnitudeEstimate(Struct, frozen=True):
    """The subject has given a number on a scale of its own (free modulus)."""

    number: float | None  # above 0; None: the subject gave no answer
    first_touch: float | None = None  # of a key or the field [s, session clock]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Hand | None = None  # that answered
    input_device: str | None = None


class PairedChoice(Struct, frozen=True):
    """The subject has chosen the stimulus that has more of the descriptor."""

    choice: Choice | None  # None: the subject gave no answer
    first_touch: float | None = None  # [s, session clock]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Hand | None = None  # that answered
    input_device: str | None = None


class Note(Struct, frozen=True):
    """The experimenter writes a note; nothing else changes."""

    text: str


class _WithReason(Struct, frozen=True):
    """Somebody decides something, and says why."""

    reason: str


class Redo(_WithReason, frozen=True):
    """Repeat the trial in hand, or the previous one just before it begins; of two compared trials, both."""


class UndoRedo(Struct, frozen=True):
    """The last redo was a mistake: what it discarded counts again. Possible until the next stroke."""


class Skip(_WithReason, frozen=True):
    """Leave out the trial in hand, and with the first of two compared trials also the second."""


class Pause(Struct, frozen=True):
    """The session is paused."""


class Resume(Struct, frozen=True):
    """The experimenter continues after a pause or a rest."""


class RestOver(Struct, frozen=True):
    """The time of a rest is up."""


class Abort(_WithReason, frozen=True):
    """The session ends now."""


class Finish(Struct, frozen=True):
    """The experimenter ends a session whose trials are all done."""


Event = (
    Begin | StimulusMounted | Zeroed | ContactOnset | FingerLifted | Settled | StrokeDone | Scored
    | MagnitudeEstimate | PairedChoice | Note | Redo | UndoRedo | Skip | Pause | Resume | RestOver | Abort | Finish
)  # fmt: skip

EVENT_NAMES: dict[type[Event], str] = {
    Abort: "abort",
    Begin: "begin",
    StimulusMounted: "a mounted stimulus",
    Zeroed: "a measured zero",
    ContactOnset: "a touch",
    FingerLifted: "a lift",
    Settled: "a finger that stays off",
    StrokeDone: "a stroke reported by hand",
    Scored: "a score",
    MagnitudeEstimate: "a number",
    PairedChoice: "a choice",
    Note: "a note",
    Redo: "redo",
    UndoRedo: "the undoing of a redo",
    Skip: "skip",
    Pause: "pause",
    Resume: "resume",
    RestOver: "the end of a rest",
    Finish: "finish",
}

# ---- commands


class AskBegin(Struct, frozen=True):
    """Wait for the experimenter to begin."""


class ShowInstruction(Struct, frozen=True):
    """Read the block's instruction to the subject."""

    block: Block


class AskMount(Struct, frozen=True):
    """Have the experimenter put the trial's stimulus on."""

    trial: Trial


class _TakeCommand(Struct, frozen=True):
    """A command about a take."""

    trial: int
    take: int


class StartTake(_TakeCommand, frozen=True):
    """From here on readings belong to this take."""


class MeasureZero(Struct, frozen=True):
    """Measure an unloaded stretch; nobody may touch."""


class AskStroke(Struct, frozen=True):
    """Have the subject stroke."""

    trial: Trial
    allowed: int = 1  # strokes; every further one is flagged


class AskScore(Struct, frozen=True):
    """Have the subject judge on the line from 0 to 100; answered by Scored."""

    trial: Trial
    scale_ends: tuple[str, str]
    ticks: int = 0  # marks between the ends
    question: str = ""


class AskNumber(Struct, frozen=True):
    """Have the subject give a number on a scale of its own; answered by MagnitudeEstimate."""

    trial: Trial
    question: str


class AskChoice(Struct, frozen=True):
    """Have the subject choose one of two; answered by PairedChoice."""

    first: Trial
    second: Trial  # the trial in hand
    question: str


class AskRest(Struct, frozen=True):
    """Let the subject rest; Resume ends the rest at any time."""

    duration: float | None  # [s], after which the session continues; None: until the experimenter continues


class KeepTake(_TakeCommand, frozen=True):
    """The take is over and counts."""


class DiscardTake(_TakeCommand, frozen=True):
    """The take does not count; its readings stay."""

    reason: str


class RestoreTake(_TakeCommand, frozen=True):
    """A take that a redo discarded is in hand again; its readings end where they ended."""


class LeaveOut(Struct, frozen=True):
    """A trial is left out together with the one before it, or again after a redo was undone."""

    trial: int
    reason: str


class AskFinish(Struct, frozen=True):
    """Wait for the experimenter to end the session, or to have the last trial repeated."""


class _Sentence(Struct, frozen=True):
    """A message to people."""

    sentence: str


class Tell(_Sentence, frozen=True):
    """Say something that needs no answer."""


class Refuse(_Sentence, frozen=True):
    """The event does not fit the state; nothing has changed."""


class EndSession(Struct, frozen=True):
    """Stop recording."""

    reason: str
    complete: bool


Command = (
    AskBegin | ShowInstruction | AskMount | StartTake | MeasureZero | AskStroke | AskScore | AskNumber | AskChoice
    | AskRest | KeepTake | DiscardTake | RestoreTake | LeaveOut | AskFinish | Tell | Refuse | EndSession
)  # fmt: skip


AnswerEvent = Scored | MagnitudeEstimate | PairedChoice

_EVENTS_OF: dict[Answer, type[AnswerEvent]] = {"line": Scored, "number": MagnitudeEstimate, "choice": PairedChoice}


def answer_problem(answer: AnswerEvent, expected: Answer) -> str | None:
    """Return a sentence on what is wrong with an answer where `expected`, not "none", is due; None where nothing is.

    >>> answer_problem(Scored(120.0), "line")
    'a score lies between 0 and 100; 120 does not'
    >>> answer_problem(Scored(12.0), "number")
    'this trial asks for a number, not for a score'
    """
    expected_kind = _EVENTS_OF[expected]
    if not isinstance(answer, expected_kind):
        return f"this trial asks for {EVENT_NAMES[expected_kind]}, not for {EVENT_NAMES[type(answer)]}"
    match answer:
        case Scored(score) if score is not None and not 0 <= score <= 100:
            return f"a score lies between 0 and 100; {score:g} does not"
        case Scored(positions=positions) if not all(0 <= x <= 100 and math.isfinite(t) for t, x in positions):
            return "every position on the line has a time and lies between 0 and 100; one of these does not"
        case Scored(positions=positions) if any(later < earlier for (earlier, _), (later, _) in pairwise(positions)):
            return "positions on the line come in the order of time; these do not"
        case MagnitudeEstimate(number) if number is not None and not (number > 0 and math.isfinite(number)):
            return f"a number on a scale of one's own is above 0; {number:g} is not"
        case _:
            return None
