"""What the analyst's window asks of the work, and what the work says."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from daq_app.analyst.frame import Film, Finger
from daq_app.analyst.raw import RawReadings
from daq_app.wording import tr_noop
from sessions.report.contents import PredictionFinding, Report

Edge = Literal["onset", "lift", "steady begin", "steady end"]
EDGES: tuple[Edge, ...] = tr_noop(("onset", "steady begin", "steady end", "lift"))
Key = tuple[int | None, int | None]  # trial, and number of the stroke, of a predicted row


# ---- what the work says


@dataclass(frozen=True, slots=True)
class Step:
    """Work goes on."""

    part: float  # of all of it, 0 to 1
    words: str
    left: float | None = None  # about how long it will still take [s]; None: not known
    load_steps: int = 0  # of which `part` are done; 0: it is not done in load steps


@dataclass(frozen=True, slots=True)
class History:
    """The decisions that can be undone, the last one first, and those that can be redone, the first one first."""

    done: tuple[str, ...] = ()  # each in words
    undone: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Found:
    """What is known of the session now: its strokes alone, or the model's answers too."""

    stage: Literal["analysed", "predicted"]
    report: Report
    history: History = History()


@dataclass(frozen=True, slots=True, eq=False)
class Answered:
    """The model's answer to one trial."""

    finding: PredictionFinding
    finger: Finger | None  # None where there is no answer


@dataclass(frozen=True, slots=True)
class Drawn:
    """A picture of the session; `png` is empty where there are no numbers for it."""

    name: str
    title: str
    png: bytes


@dataclass(frozen=True, slots=True, eq=False)
class Filmed:
    """The history of one trial's finger."""

    key: Key
    film: Film
    why: str = ""  # why it ends before a settled state; "" where it has one


@dataclass(frozen=True, slots=True, eq=False)
class Read:
    """The readings around one stroke, as they were recorded."""

    stroke: int  # its number
    readings: RawReadings


@dataclass(frozen=True, slots=True, eq=False)
class Compared:
    """Another session, analysed and predicted alike."""

    folder: str
    report: Report
    fingers: Mapping[Key, Finger] = field(default_factory=dict[Key, Finger])  # the settled ones


@dataclass(frozen=True, slots=True)
class Written:
    """A report, an export or a picture is whole."""

    path: str


@dataclass(frozen=True, slots=True)
class Decided:
    """A decision is recorded, undone or redone, and every number follows."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Problem:
    """Something could not be done; what was known before stays."""

    sentence: str


@dataclass(frozen=True, slots=True)
class Cancelled:
    """Somebody stopped the work; what was done before stays."""


@dataclass(frozen=True, slots=True)
class Idle:
    """All that was asked for is done."""


# ---- what the window asks


@dataclass(frozen=True, slots=True)
class Choose:
    """Somebody chose a trial, or a stroke of a recording without trials."""

    row: int


@dataclass(frozen=True, slots=True)
class Move:
    """Somebody moved an edge of a stroke's windows."""

    stroke: int  # its number
    edge: Edge
    time: float  # [s, device time]
    by: str  # a code, never a name
    why: str


@dataclass(frozen=True, slots=True)
class Undo:
    """The last decision is taken back, or with `again` the last taking back."""

    by: str
    again: bool = False


@dataclass(frozen=True, slots=True)
class Respond:
    """Another quantity at the ending is held against the scores."""

    response: str  # one of `solver.quantities`


@dataclass(frozen=True, slots=True)
class Draw:
    """Asks for a picture of the session."""

    name: str


@dataclass(frozen=True, slots=True)
class ShowHistory:
    """Asks for the way of one trial's finger."""

    key: Key


@dataclass(frozen=True, slots=True)
class ShowReadings:
    """Asks for the readings around one stroke."""

    stroke: int  # its number


@dataclass(frozen=True, slots=True)
class Compare:
    """Asks for another session beside this one."""

    folder: str


@dataclass(frozen=True, slots=True)
class Write:
    """Asks for a file: "report", one of `sessions.exchange.FORMATS`, or "picture NAME" of what `pictures` names."""

    what: str
    path: str


@dataclass(frozen=True, slots=True)
class GoOn:
    """What was stopped goes on."""


@dataclass(frozen=True, slots=True)
class Stop:
    """Whatever is being done is stopped."""


Ask = Choose | Move | Undo | Draw | ShowHistory | ShowReadings | Compare | Write | GoOn | Stop
Said = Step | Found | Answered | Drawn | Filmed | Read | Compared | Written | Decided | Problem | Cancelled | Idle
Message = Ask | Said | Respond
