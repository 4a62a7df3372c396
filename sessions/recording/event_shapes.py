"""What the data of each kind of event must hold, so that whatever reads the log finds what it looks for.

Kinds and names that are not listed here may hold anything: later versions add theirs.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

import msgspec

from drivers.transducer import COUNTS
from sessions.json_document import converted, json_object

Whole: TypeAlias = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]  # what SQLite, HDF5 and NumPy hold alike
Count: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
SixNumbers: TypeAlias = tuple[float, float, float, float, float, float]


class _Take(msgspec.Struct):
    take: Count


class _Discarded(_Take):
    reason: str


class _Scored(msgspec.Struct):
    score: float | None
    positions: list[tuple[float, float]] | None = None


class _Number(msgspec.Struct):
    number: float | None


class _PairedChoice(msgspec.Struct):
    choice: Literal["first", "second"] | None


class _Zeroed(msgspec.Struct):
    mean: SixNumbers


_Losses = msgspec.defstruct("_Losses", [*((name, Count, 0) for name in COUNTS), ("rate_words", str, "")])


class _Sentence(msgspec.Struct):
    sentence: str


class _Ended(msgspec.Struct):
    reason: str = ""
    cause: str = ""
    complete: bool = False
    readings: Count = 0
    health: dict[str, Any] | None = None


class _Resumed(msgspec.Struct):
    last_ns: Whole
    gap: float | None = None


SHAPES: Mapping[str, type[msgspec.Struct]] = {
    "take_started": _Take,
    "take_kept": _Take,
    "take_restored": _Take,
    "take_discarded": _Discarded,
    "scored": _Scored,
    "number_given": _Number,
    "chosen": _PairedChoice,
    "zeroed": _Zeroed,
    "losses": _Losses,
    "log_torn": _Sentence,
    "not_restored": _Sentence,
    "ended": _Ended,
    "resumed": _Resumed,
}


def event_data(kind: str, text: str) -> dict[str, Any]:
    """Return the data of an event from its JSON text. Raises ValueError where it is none of that kind."""
    data = json_object(text)
    converted(data, SHAPES.get(kind, dict[str, Any]))
    return data
