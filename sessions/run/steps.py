"""What may happen in the course of a session, and what is to be done: events and commands. All of it is data."""

from dataclasses import dataclass

from sessions.plan.plan import Block, Choice, Hand, Trial

# ---- what may happen


@dataclass(frozen=True, slots=True)
class Begin:
    """The experimenter begins the session."""


@dataclass(frozen=True, slots=True)
class StimulusMounted:
    """The experimenter has put a stimulus on."""

    code: str  # as read off its back


@dataclass(frozen=True, slots=True)
class Zeroed:
    """An unloaded stretch of readings was measured. The readings themselves are never altered."""

    mean: tuple[float, ...] = ()  # (6,) raw units
    spread: tuple[float, ...] = ()  # (6,) standard deviation, raw units
    readings: int = 0  # in the stretch
    duration: float = 0.0  # [s]
    first_sequence: int = 0  # record number of its first reading
    last_sequence: int = 0
    normal_force: float = 0.0  # mean of N as the calibration gives it, nothing subtracted [N]
    noise: float = 0.0  # standard deviation of N [N]


@dataclass(frozen=True, slots=True)
class ContactOnset:
    """The live detector saw the finger touch."""

    time: float = 0.0  # [s, device time]
    noticed: float = 0.0  # reading at which it was certain [s, device time]


@dataclass(frozen=True, slots=True)
class FingerLifted:
    """The live detector saw the finger leave."""

    time: float = 0.0  # [s, device time]
    noticed: float = 0.0  # reading at which it was certain [s, device time]


@dataclass(frozen=True, slots=True)
class Settled:
    """The finger has been off for a moment since the last lift, so that the take may end."""

    time: float = 0.0  # of the reading at which it had [s, device time]


@dataclass(frozen=True, slots=True)
class StrokeDone:
    """The experimenter says that the stroke is done, in a visit without a transducer."""


@dataclass(frozen=True, slots=True)
class Scored:
    """The subject has judged on the line. What an input device cannot tell is empty or None."""

    score: float | None  # 0 to 100; None: the subject gave no answer
    positions: tuple[tuple[float, float], ...] = ()  # every one on the line: (session clock [s], 0 to 100), in order
    first_touch: float | None = None  # session clock [s]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Hand | None = None  # that answered
    input_device: str | None = None  # such as a pen, a finger on the screen


@dataclass(frozen=True, slots=True)
class MagnitudeEstimate:
    """The subject has given a number on a scale of its own (free modulus)."""

    number: float | None  # above 0; None: the subject gave no answer
    first_touch: float | None = None  # of a key or the field [s, session clock]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Hand | None = None  # that answered
    input_device: str | None = None


@dataclass(frozen=True, slots=True)
class PairedChoice:
    """The subject has said which of two stimuli has more of what is asked."""

    choice: Choice | None  # None: the subject gave no answer
    first_touch: float | None = None  # [s, session clock]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Hand | None = None  # that answered
    input_device: str | None = None


@dataclass(frozen=True, slots=True)
class Note:
    """The experimenter writes something down; nothing else changes."""

    text: str


@dataclass(frozen=True, slots=True)
class Redo:
    """The trial in hand is to be done again; just before a trial begins, the one before it.

    Of two stimuli that are compared both are presented again.
    """

    reason: str


@dataclass(frozen=True, slots=True)
class UndoRedo:
    """The last redo was a mistake: what it discarded counts again. Meant until the next stroke."""


@dataclass(frozen=True, slots=True)
class Skip:
    """The trial in hand is to be left out, and with the first of two that are compared also the second."""

    reason: str


@dataclass(frozen=True, slots=True)
class Pause:
    """Everybody rests."""


@dataclass(frozen=True, slots=True)
class Resume:
    """The experimenter goes on, after a pause or a rest."""


@dataclass(frozen=True, slots=True)
class RestOver:
    """The time of a rest is up."""


@dataclass(frozen=True, slots=True)
class Abort:
    """The session ends now."""

    reason: str


@dataclass(frozen=True, slots=True)
class Finish:
    """The experimenter ends a session whose trials are all done."""


Event = (
    Begin
    | StimulusMounted
    | Zeroed
    | ContactOnset
    | FingerLifted
    | Settled
    | StrokeDone
    | Scored
    | MagnitudeEstimate
    | PairedChoice
    | Note
    | Redo
    | UndoRedo
    | Skip
    | Pause
    | Resume
    | RestOver
    | Abort
    | Finish
)

# ---- what is to be done


@dataclass(frozen=True, slots=True)
class AskBegin:
    """Wait for the experimenter to begin."""


@dataclass(frozen=True, slots=True)
class ShowInstruction:
    """Read the block's instruction to the subject."""

    block: Block


@dataclass(frozen=True, slots=True)
class AskMount:
    """Have the experimenter put the trial's stimulus on."""

    trial: Trial


@dataclass(frozen=True, slots=True)
class StartTake:
    """From here on readings belong to this take."""

    trial: int
    take: int


@dataclass(frozen=True, slots=True)
class MeasureZero:
    """Measure an unloaded stretch; nobody may touch."""


@dataclass(frozen=True, slots=True)
class AskStroke:
    """Have the subject stroke."""

    trial: Trial
    allowed: int = 1  # strokes; every further one is flagged


@dataclass(frozen=True, slots=True)
class AskScore:
    """Have the subject judge on the line from 0 to 100; answered by Scored."""

    trial: Trial
    scale_ends: tuple[str, str]
    ticks: int = 0  # marks between the ends
    question: str = ""


@dataclass(frozen=True, slots=True)
class AskNumber:
    """Have the subject give a number on a scale of its own; answered by MagnitudeEstimate."""

    trial: Trial
    question: str


@dataclass(frozen=True, slots=True)
class AskChoice:
    """Have the subject say which of two; answered by PairedChoice."""

    first: Trial
    second: Trial  # the trial in hand
    question: str


@dataclass(frozen=True, slots=True)
class AskRest:
    """Let the subject rest; Resume goes on at any time."""

    duration: float | None  # [s], after which it goes on by itself; None: until the experimenter goes on


@dataclass(frozen=True, slots=True)
class KeepTake:
    """The take is over and counts."""

    trial: int
    take: int


@dataclass(frozen=True, slots=True)
class DiscardTake:
    """The take does not count; its readings stay."""

    trial: int
    take: int
    reason: str


@dataclass(frozen=True, slots=True)
class RestoreTake:
    """A take that a redo discarded is in hand again; its readings end where they ended."""

    trial: int
    take: int


@dataclass(frozen=True, slots=True)
class LeaveOut:
    """A trial is left out together with the one before it, or again after a redo was undone."""

    trial: int
    reason: str


@dataclass(frozen=True, slots=True)
class AskFinish:
    """Wait for the experimenter to end the session, or to have the last trial repeated."""


@dataclass(frozen=True, slots=True)
class Tell:
    """Say something that needs no answer."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Refuse:
    """The event is not meant now; nothing has changed."""

    sentence: str


@dataclass(frozen=True, slots=True)
class EndSession:
    """Stop recording."""

    reason: str
    complete: bool


Command = (
    AskBegin
    | ShowInstruction
    | AskMount
    | StartTake
    | MeasureZero
    | AskStroke
    | AskScore
    | AskNumber
    | AskChoice
    | AskRest
    | KeepTake
    | DiscardTake
    | RestoreTake
    | LeaveOut
    | AskFinish
    | Tell
    | Refuse
    | EndSession
)
