"""What the course of a session is made of: its states, what may happen, and what is to be done. All of it is data."""

from dataclasses import dataclass, replace
from typing import Literal

from sessions.plan import Block, SessionPlan, Trial

# ---- where a session is


@dataclass(frozen=True, slots=True)
class Progress:
    """How far one trial is."""

    takes: int = 0  # begun so far
    kept: bool = False  # True when the last of them counts


@dataclass(frozen=True, slots=True)
class Place:
    """Which trial of the plan is in hand, and how far every trial is."""

    plan: SessionPlan
    index: int  # of the trial in hand
    progress: tuple[Progress, ...]  # one for each trial of the plan

    @property
    def trial(self) -> Trial:
        """Return the trial in hand."""
        return self.plan.trials[self.index]

    @property
    def block(self) -> Block:
        """Return the block of the trial in hand."""
        return next(block for block in self.plan.blocks if self.trial in block.trials)

    @property
    def take(self) -> int:
        """Return the number of the latest take of the trial in hand; 0 before the first."""
        return self.progress[self.index].takes

    @property
    def last(self) -> bool:
        """Say whether the trial in hand is the last."""
        return self.index == len(self.progress) - 1

    def at(self, index: int) -> "Place":
        """Return the place with another trial in hand."""
        return replace(self, index=index)

    def with_progress(self, progress: Progress) -> "Place":
        """Return the place with the trial in hand that far."""
        return replace(self, progress=(*self.progress[: self.index], progress, *self.progress[self.index + 1 :]))


@dataclass(frozen=True, slots=True)
class Idle:
    """All is set up; the session has not begun."""

    place: Place


@dataclass(frozen=True, slots=True)
class Mounting:
    """The experimenter puts the trial's stimulus on; no take is open."""

    place: Place


@dataclass(frozen=True, slots=True)
class Taring:
    """A take has begun; the zero is measured with nothing touching."""

    place: Place


@dataclass(frozen=True, slots=True)
class Ready:
    """The subject may stroke."""

    place: Place


@dataclass(frozen=True, slots=True)
class Stroking:
    """The finger touches."""

    place: Place


@dataclass(frozen=True, slots=True)
class Scoring:
    """The stroke is done and the subject judges."""

    place: Place
    touching: bool = False  # True during a further stroke, which nobody asked for


@dataclass(frozen=True, slots=True)
class Paused:
    """Nothing is asked of anybody. No take is open, but for one whose stroke is done and waits for its score."""

    place: Place
    scoring: bool


@dataclass(frozen=True, slots=True)
class Closing:
    """Every trial is done; the last can still be repeated."""

    place: Place


@dataclass(frozen=True, slots=True)
class Ended:
    """The session is over."""

    reason: str
    complete: bool  # True when every trial was done or skipped


State = Idle | Mounting | Taring | Ready | Stroking | Scoring | Paused | Closing | Ended

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
class StrokeDone:
    """The experimenter says that the stroke is done, in a visit without a transducer."""


@dataclass(frozen=True, slots=True)
class Scored:
    """The subject has judged. What an input device cannot tell is empty or None."""

    score: float | None  # 0 to 100; None: the subject gave no answer
    positions: tuple[tuple[float, float], ...] = ()  # every one on the line: (session clock [s], 0 to 100), in order
    first_touch: float | None = None  # session clock [s]
    corrections: int | None = None  # how often the subject changed an answer given
    hand: Literal["left", "right"] | None = None  # that answered
    input_device: str | None = None  # such as a pen, a finger on the screen


@dataclass(frozen=True, slots=True)
class Redo:
    """The trial in hand is to be done again; just before a trial begins, the one before it."""

    reason: str


@dataclass(frozen=True, slots=True)
class Skip:
    """The trial in hand is to be left out."""

    reason: str


@dataclass(frozen=True, slots=True)
class Pause:
    """Everybody rests."""


@dataclass(frozen=True, slots=True)
class Resume:
    """The rest is over."""


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
    | StrokeDone
    | Scored
    | Redo
    | Skip
    | Pause
    | Resume
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


@dataclass(frozen=True, slots=True)
class AskScore:
    """Have the subject judge."""

    trial: Trial
    scale_ends: tuple[str, str]


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
    | KeepTake
    | DiscardTake
    | AskFinish
    | Tell
    | Refuse
    | EndSession
)
