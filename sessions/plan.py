"""What a session will do: stimuli, trials, blocks, and the whole plan. All of it is data."""

from dataclasses import dataclass
from typing import Literal

Origin = Literal["measured", "set", "default"]  # where a value came from; a default was chosen by nobody
Hand = Literal["left", "right"]
PROXIMAL_TO_DISTAL = 1
DISTAL_TO_PROXIMAL = -1


@dataclass(frozen=True, slots=True)
class Stimulus:
    """One surface to be stroked."""

    descriptor: str  # "stickiness" or "slipperiness", or what a protocol names
    index: int  # its maker's number on the descriptor, 0 to 100; not a score
    code: str  # opaque label on its back, all that experimenter and subject are shown


@dataclass(frozen=True, slots=True)
class Trial:
    """One stimulus presented once."""

    number: int  # from 1, over the whole session
    block: str  # name of its block
    stimulus: Stimulus
    direction: int  # +1 proximal to distal, -1 distal to proximal
    repetition: int  # from 1


@dataclass(frozen=True, slots=True)
class Block:
    """The trials of one descriptor, with what the subject is told."""

    name: str
    instruction: str
    direction: int  # +1 proximal to distal, -1 distal to proximal
    indentation: float  # depth the model presses the finger to in this block [mm]
    scale_ends: tuple[str, str]  # what a score of 0 and of 100 mean
    trials: tuple[Trial, ...]


@dataclass(frozen=True, slots=True)
class Frame:
    """How the transducer's axes lie to the stimulus's face, each value with its origin."""

    normal: str = "-z"  # axis of the wrench along which pressing is positive: one of +x -x +y -y +z -z
    normal_origin: Origin = "default"
    height: float = 0.0  # the face above the transducer's origin [mm]
    height_origin: Origin = "default"


@dataclass(frozen=True, slots=True)
class SessionPlan:
    """All that is decided before the subject sits down."""

    protocol: str
    subject: str  # a code, never a name
    seed: int
    order_rule: str  # how stimulus orders were made, e.g. "shuffled"
    blocks: tuple[Block, ...]  # none for an imported recording
    forces: bool  # True when strokes are recorded by a transducer, False for a scores-only visit
    frame: Frame
    contact_area: float = 100.0  # [mm2], for tau_max
    contact_area_origin: Origin = "default"
    contact_angle: float = 45.0  # between the finger's axis and the face [degrees]
    contact_angle_origin: Origin = "default"
    stroking_hand: Hand | None = None  # None: nobody stated it
    answering_hand: Hand | None = None

    @property
    def trials(self) -> tuple[Trial, ...]:
        """All trials in their order."""
        return tuple(trial for block in self.blocks for trial in block.trials)
