"""Protocol: a readable file that says how sessions are run, and the plan of one session made from it."""

import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from sessions.orders import opaque_codes, shuffled
from sessions.plan import (
    DISTAL_TO_PROXIMAL,
    PROXIMAL_TO_DISTAL,
    Block,
    Frame,
    Hand,
    SessionPlan,
    Stimulus,
    Trial,
)
from sessions.toml_file import NotAllowed, SettingsError, load_toml

FOLDER = Path(__file__).parent
DIRECTIONS = {"proximal to distal": PROXIMAL_TO_DISTAL, "distal to proximal": DISTAL_TO_PROXIMAL}
LARGEST_SEED = 2**31 - 1


@dataclass(frozen=True, slots=True)
class BlockOutline:
    """The stimuli of one descriptor and how they are stroked and scored; their order is not decided yet."""

    name: str
    descriptor: str
    direction: Literal["proximal to distal", "distal to proximal"]
    indentation: float  # depth the model presses the finger to [mm]
    indices: tuple[int, ...]  # of the stimuli, 0 to 100
    instruction: str  # read to the subject before the block
    scale_ends: tuple[str, str]  # what 0 and 100 mean

    def __post_init__(self) -> None:
        """Check ranges."""
        for name in ("name", "descriptor", "instruction"):
            if not getattr(self, name).strip():
                raise NotAllowed(name, getattr(self, name), "it must not be empty")
        if not 0 < self.indentation <= 10:
            raise NotAllowed("indentation", self.indentation, "it must lie above 0 and up to 10 mm")
        if not self.indices or len(set(self.indices)) < len(self.indices):
            raise NotAllowed("indices", list(self.indices), "there must be at least one, and none may come twice")
        if not all(0 <= index <= 100 for index in self.indices):
            raise NotAllowed("indices", list(self.indices), "each must lie between 0 and 100")
        if not all(end.strip() for end in self.scale_ends):
            raise NotAllowed("scale_ends", list(self.scale_ends), "both ends of the scale must be named")


@dataclass(frozen=True, slots=True)
class Face:
    """Where the stimulus's face lies, and the area the finger touches it with; None where nobody stated it."""

    normal: Literal["+x", "-x", "+y", "-y", "+z", "-z"] | None = None
    height: float | None = None  # above the transducer's origin [mm]
    height_origin: Literal["measured", "set"] = "set"
    contact_area: float | None = None  # [mm2]

    def __post_init__(self) -> None:
        """Check ranges."""
        if self.height is not None and not -500 <= self.height <= 500:
            raise NotAllowed("height", self.height, "it must lie between -500 and 500 mm")
        if self.contact_area is not None and not 1 <= self.contact_area <= 2000:
            raise NotAllowed("contact_area", self.contact_area, "it must lie between 1 and 2000 mm2")

    @property
    def frame(self) -> Frame:
        """Return the frame, each value with its origin."""
        frame = Frame()
        if self.normal is not None:
            frame = replace(frame, normal=self.normal, normal_origin="set")
        if self.height is not None:
            frame = replace(frame, height=self.height, height_origin=self.height_origin)
        return frame


@dataclass(frozen=True, slots=True)
class Protocol:
    """How sessions are run."""

    name: str
    title: str
    order: Literal["shuffled"]  # how stimulus orders are made
    label_seed: int  # decides the opaque labels: the same stimulus bears the same label throughout a study
    contact_angle: float  # between the finger's axis and the surface [degrees]
    blocks: tuple[BlockOutline, ...]
    face: Face = field(default_factory=Face)

    def __post_init__(self) -> None:
        """Check ranges, and that blocks and stimuli can be told apart."""
        if not re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", self.name):
            raise NotAllowed("name", self.name, "it must be of small letters, digits and single hyphens")
        _check_seed("label_seed", self.label_seed)
        if not 10 <= self.contact_angle <= 90:
            raise NotAllowed("contact_angle", self.contact_angle, "it must lie between 10 and 90 degrees")
        if not self.blocks:
            raise NotAllowed("blocks", [], "there must be at least one")
        names = [block.name for block in self.blocks]
        for i, name in enumerate(names):
            if name in names[:i]:
                raise NotAllowed(f"blocks[{i}].name", name, "no two blocks may have the same name")


def protocol_names() -> tuple[str, ...]:
    """Return the names of the protocols that come with the program: the files of this folder."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def protocol(name_or_path: str | Path) -> Protocol:
    """Return the built-in protocol of that name, or the one in the file of that path.

    Raises SettingsError for an unknown name and for anything wrong in the file, FileNotFoundError for a missing file.
    """
    given = str(name_or_path)
    if given in protocol_names():
        return load_toml(FOLDER / f"{given}.toml", Protocol)
    if not given.endswith(".toml"):
        built_in = ", ".join(protocol_names())
        raise SettingsError(f"there is no protocol {given}; built in: {built_in}; or give the path of a .toml file")
    return load_toml(Path(given), Protocol)


def plan(
    protocol: Protocol,
    subject: str,
    seed: int,
    *,
    forces: bool = True,
    frame: Frame | None = None,
    contact_area: float | None = None,
    stroking_hand: Hand | None = None,
    answering_hand: Hand | None = None,
) -> SessionPlan:
    """Return the plan of one session: who, which stimuli under which labels, in which order.

    `forces` is False for a visit that only scores. `frame` and `contact_area` [mm2], where given, replace the
    protocol's. Raises SettingsError where `subject` is no code or `seed` is out of range.
    """
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}", subject):
        raise SettingsError(f'subject = "{subject}" is not allowed: a code of letters, digits, - and _, never a name')
    try:
        _check_seed("seed", seed)
    except NotAllowed as error:
        raise SettingsError(str(error)) from error
    area = protocol.face.contact_area if contact_area is None else contact_area
    made = SessionPlan(
        protocol=protocol.name,
        subject=subject,
        seed=seed,
        order_rule=protocol.order,
        blocks=_blocks(protocol, seed),
        forces=forces,
        frame=frame or protocol.face.frame,
        contact_angle=protocol.contact_angle,
        contact_angle_origin="set",
        stroking_hand=stroking_hand,
        answering_hand=answering_hand,
    )
    return made if area is None else replace(made, contact_area=area, contact_area_origin="set")


def _blocks(protocol: Protocol, seed: int) -> tuple[Block, ...]:
    """Return the blocks with their trials in order."""
    codes = iter(opaque_codes(sum(len(outline.indices) for outline in protocol.blocks), protocol.label_seed))
    blocks: list[Block] = []
    number = 1
    for outline in protocol.blocks:
        stimuli = {index: Stimulus(outline.descriptor, index, next(codes)) for index in outline.indices}
        direction = DIRECTIONS[outline.direction]
        order = enumerate(shuffled(outline.indices, seed, outline.name), number)
        trials = tuple(Trial(n, outline.name, stimuli[index], direction, repetition=1) for n, index in order)
        number += len(trials)
        blocks.append(
            Block(outline.name, outline.instruction, direction, outline.indentation, outline.scale_ends, trials)
        )
    return tuple(blocks)


def _check_seed(key: str, seed: int) -> None:
    """Raise NotAllowed unless the seed is a whole number every language can hold."""
    if not 0 <= seed <= LARGEST_SEED:
        raise NotAllowed(key, seed, f"it must lie between 0 and {LARGEST_SEED}")
