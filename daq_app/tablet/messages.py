"""What the tablet and the program say to each other: JSON texts with a `type`, checked where they arrive."""

from typing import Annotated, Literal

import msgspec
from msgspec import Meta, Struct

from daq_app.window.answer import Device, Which

LARGEST = 1 << 20  # of a message [bytes]: an hour of an answer's positions
Short = Annotated[str, Meta(max_length=200)]
PixelsPerMm = Annotated[float, Meta(ge=1.0, le=40.0)]

# ---- from the tablet


class Hello(Struct, frozen=True, tag="hello"):
    """The first thing that a tablet says: by the code that somebody typed, or the token it got for that."""

    code: Short = ""
    token: Short = ""
    pixels_per_mm: PixelsPerMm | None = None  # CSS pixels; None: nobody held a ruler to it


class Ruler(Struct, frozen=True, tag="ruler"):
    """Somebody held a ruler to the line."""

    pixels_per_mm: PixelsPerMm


class Act(Struct, frozen=True, array_like=True):
    """One thing that the subject did on the page."""

    time: float  # clock of the tablet [ms]
    kind: Literal["press", "drag", "release", "step", "number", "choose"]
    value: float | Which | None  # 0 to 100 on the line, a step on it, a number, or one of two
    device: Device


class AnswerGiven(Struct, frozen=True, tag="given"):
    """An answer, sent again and again until it is stored."""

    key: Short  # of the question
    acts: tuple[Act, ...]
    sent: float  # clock of the tablet [ms]


FromTablet = Hello | Ruler | AnswerGiven

# ---- to the tablet


class Welcome(Struct, frozen=True, tag="welcome"):
    """The tablet is the one that is let in; it comes back with the token."""

    token: str


class Refused(Struct, frozen=True, tag="refused"):
    """The tablet is not let in."""

    sentence: str


class Page(Struct, frozen=True, tag="page"):
    """What is to be shown."""

    kind: Literal["read", "line", "number", "choice"]
    key: str  # of the question; empty where none is asked
    title: str
    text: str
    ends: tuple[str, str]
    ticks: int
    hand: Literal["left", "right"]
    language: str
    direction: Literal["ltr", "rtl"]
    force: bool  # a bar of how hard the finger presses is shown
    setting: bool  # no session runs: the tablet is being set up
    words: dict[str, str]  # the page's own, in the subject's language


class Stored(Struct, frozen=True, tag="stored"):
    """The answer to a question is written down and safe, or nobody asks for it any more: it need not be sent again."""

    key: str


class Force(Struct, frozen=True, tag="force"):
    """How hard the finger presses."""

    part: float  # of the bar [-]


ToTablet = Welcome | Refused | Page | Stored | Force

_read = msgspec.json.Decoder(FromTablet)
_write = msgspec.json.Encoder()


def read(text: str | bytes) -> FromTablet:
    """Return what a tablet said. Raises msgspec.DecodeError for anything else."""
    return _read.decode(text)


def written(message: ToTablet) -> str:
    """Return a message as it is sent."""
    return _write.encode(message).decode()
