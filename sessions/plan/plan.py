"""What a session will do: stimuli, trials, blocks, and the whole plan. All of it is data."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

from sessions.toml_file import check_range

Origin = Literal["measured", "set", "default"]  # where a value came from; nobody chose a default
Hand = Literal["left", "right"]
Phase = Literal["pre-evaluation", "practice", "main"]  # only the trials of "main" are the experiment's
Answer = Literal["line", "number", "choice", "none"]  # on a 0 to 100 line, a free number, which of two, nothing
Choice = Literal["first", "second"]  # of the two stimuli compared
SubjectSees = Literal["instruction", "trial count", "code", "forces"]
ExperimenterSees = Literal["trial count", "answer", "forces"]
PROXIMAL_TO_DISTAL = 1
DISTAL_TO_PROXIMAL = -1
NORMALS = ("+x", "-x", "+y", "-y", "+z", "-z")


class Blinded(ValueError):
    """The request needs the key to stimuli and codes, which is still sealed."""


@dataclass(frozen=True, slots=True)
class Stimulus:
    """One surface to be stroked."""

    descriptor: str  # "stickiness" or "slipperiness", or what a protocol names
    index: int | None  # its maker's number on the descriptor, 0 to 100; not a score; None while blinded
    code: str  # opaque label on its back, the only name that experimenter and subject see

    @property
    def display_name(self) -> str:
        """Return the name to display: descriptor and index, or descriptor and code while the index is sealed."""
        return f"{self.descriptor} {self.code if self.index is None else self.index}"

    @property
    def known_index(self) -> int:
        """Return the index. Raises Blinded while it is sealed."""
        if self.index is None:
            raise Blinded(f"which stimulus bears the code {self.code} is sealed: 'daq-app unblind' opens the key")
        return self.index


@dataclass(frozen=True, slots=True)
class Trial:
    """One stimulus presented once."""

    number: int  # from 1, over the whole session
    block: str  # name of its block
    stimulus: Stimulus
    direction: int  # +1 proximal to distal, -1 distal to proximal
    repetition: int  # from 1
    phase: Phase = "main"
    answer: Answer = "line"  # what the subject gives when the stroke is done
    compared_with: int | None = None  # number of the trial just before, the first of two; its answer is none
    standard: bool = False  # the surface that all others of its block are compared with


@dataclass(frozen=True, slots=True)
class Block:
    """The trials of one descriptor in one phase, with the subject's instruction."""

    name: str
    instruction: str
    direction: int  # +1 proximal to distal, -1 distal to proximal
    indentation: float  # depth the model presses the finger to in this block [mm]
    scale_ends: tuple[str, str]  # meanings of the scores 0 and 100; empty where no line is shown
    trials: tuple[Trial, ...]
    phase: Phase = "main"
    question: str = ""  # asked when an answer is due; may be empty for a line
    strokes_allowed: int = 1  # in a trial; every further one is recorded and flagged
    ticks: int = 0  # marks on the line between its ends
    indentation_origin: Origin = "set"
    candidates: tuple[Stimulus, ...] = ()  # of an adaptive block, for the next comparison; empty in other blocks

    @property
    def standard(self) -> Stimulus | None:
        """Return the stimulus that all others are compared with; None in a block without one."""
        return next((trial.stimulus for trial in self.trials if trial.standard), None)


@dataclass(frozen=True, slots=True)
class Frame:
    """The stimulus's face in the transducer's axes, each value with its origin."""

    normal: str = "-z"  # axis of the wrench along which pressing is positive, one of `NORMALS`
    normal_origin: Origin = "default"
    height: float = 0.0  # the face above the transducer's origin [mm]
    height_origin: Origin = "default"

    def with_values(self, normal: str | None, height: float | None, height_origin: Origin = "set") -> "Frame":
        """Return the frame with each value that is not None replaced."""
        frame = self if normal is None else replace(self, normal=normal, normal_origin="set")
        return frame if height is None else replace(frame, height=height, height_origin=height_origin)


@dataclass(frozen=True, slots=True)
class Rests:
    """When the subject rests; by default never."""

    after_trials: int | None = None  # of a block; None: not within a block
    between_blocks: bool = False  # never between a practice and its block
    duration: float | None = None  # [s]; None: until the experimenter continues

    def __post_init__(self) -> None:
        """Check ranges."""
        check_range("after_trials", self.after_trials, 1, 1000)
        check_range("duration", self.duration, 1, 3600, "s")


@dataclass(frozen=True, slots=True)
class Visibility:
    """What the subject and the experimenter see, besides what each must know to act."""

    subject: tuple[SubjectSees, ...] = ("instruction",)
    experimenter: tuple[ExperimenterSees, ...] = ("trial count", "answer", "forces")


@dataclass(frozen=True, slots=True)
class Finger:
    """The subject's own finger, as far as measured or stated; the model's defaults replace missing values."""

    tip_radius: float | None = None  # of the fingertip's outline [mm]
    width: float | None = None  # of the contact, across the finger [mm]


@dataclass(frozen=True, slots=True)
class SessionPlan:
    """All that is decided before the subject sits down."""

    protocol: str
    subject: str  # a code, never a name
    seed: int
    order_rule: str  # how stimulus orders were made, e.g. "shuffled" or "williams, row 3 of 10"
    blocks: tuple[Block, ...]  # none for an imported recording
    forces: bool  # True when strokes are recorded by a transducer, False for a scores-only visit
    frame: Frame
    contact_area: float = 100.0  # [mm2], for tau_max
    contact_area_origin: Origin = "default"
    contact_angle: float = 45.0  # between the finger's axis and the face [degrees]
    contact_angle_origin: Origin = "default"
    stroking_hand: Hand | None = None  # None: nobody stated it
    answering_hand: Hand | None = None
    finger: Finger = Finger()
    rests: Rests = Rests()
    shown: Visibility = Visibility()
    masking: str = ""  # of sounds; empty: none
    language: str = "en"  # that the subject reads
    study: str | None = None  # name of the study the subject is enrolled in
    order_row: int | None = None  # of the study's design, from 1
    order_seed: int | None = None  # that orders were made from, where it is not `seed`
    key_sha256: str | None = None  # of the sealed key; None: not blinded

    @property
    def blinded(self) -> bool:
        """Say whether the plan hides which stimulus bears which code."""
        return any(trial.stimulus.index is None for trial in self.trials)

    def folder_name(self, start: datetime) -> str:
        """Return the name of the session's folder; a study's visits share one protocol, so theirs has the purpose."""
        purpose = self.protocol if self.study is None else "forces" if self.forces else "scores"
        return f"{self.subject}_{purpose}_{start:%Y%m%dT%H%M%S}"

    def stroke_limit(self, trial: Trial) -> int:
        """Return the greatest number of strokes in a trial; 1 where no block holds it."""
        return next((block.strokes_allowed for block in self.blocks if trial in block.trials), 1)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All trials in their order."""
        return tuple(trial for block in self.blocks for trial in block.trials)

    def with_trials(self, change: Callable[[Trial], Trial]) -> "SessionPlan":
        """Return the plan with `change` applied to each trial."""
        blocks = (replace(block, trials=tuple(map(change, block.trials))) for block in self.blocks)
        return replace(self, blocks=tuple(blocks))
