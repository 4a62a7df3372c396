"""What the analyst's window asks of the work, and what the work says."""

from collections.abc import Mapping
from typing import Literal

from msgspec import Struct, field

from daq_app.analyst.frame import Film, Finger
from daq_app.analyst.stroke import Edge, History, RawReadings
from sessions.report.contents import PredictionFinding, Report

Key = tuple[int | None, int | None]  # trial, and number of the stroke, of a predicted row


# ---- what the work says


class Step(Struct, frozen=True):
    """Work goes on."""

    part: float  # of all of it, 0 to 1
    words: str
    left: float | None = None  # about how long it will still take [s]; None: not known
    load_steps: int = 0  # of which `part` are done; 0: it is not done in load steps


class ReportReady(Struct, frozen=True):
    """What is known of the session now: its strokes alone, or the model's answers too."""

    stage: Literal["analysed", "predicted"]
    report: Report
    history: History = History()


class Answered(Struct, frozen=True, eq=False):
    """The model's answer to one trial."""

    finding: PredictionFinding
    finger: Finger | None  # None where there is no answer


class Drawn(Struct, frozen=True):
    """A picture of the session; `png` is empty where there are no numbers for it."""

    name: str
    title: str
    png: bytes


class Filmed(Struct, frozen=True, eq=False):
    """The history of one trial's finger."""

    key: Key
    film: Film
    why: str = ""  # why it ends before a settled state; "" where it has one


class Read(Struct, frozen=True, eq=False):
    """The readings around one stroke, as they were recorded."""

    stroke: int  # its number
    readings: RawReadings


class Compared(Struct, frozen=True, eq=False):
    """Another session, analysed and predicted alike."""

    folder: str
    report: Report
    fingers: Mapping[Key, Finger] = field(default_factory=dict[Key, Finger])  # the settled ones


class Done(Struct, frozen=True):
    """A file is whole, or a decision is recorded, undone or redone, and every number follows."""

    sentence: str


class Problem(Struct, frozen=True):
    """Something could not be done; what was known before stays."""

    sentence: str


class Cancelled(Struct, frozen=True):
    """Somebody stopped the work; what was done before stays."""


class Idle(Struct, frozen=True):
    """All that was asked for is done."""


# ---- what the window asks


class Choose(Struct, frozen=True):
    """Somebody chose a trial, or a stroke of a recording without trials."""

    row: int


class Move(Struct, frozen=True):
    """Somebody moved an edge of a stroke's windows."""

    stroke: int  # its number
    edge: Edge
    time: float  # [s, device time]
    by: str  # a code, never a name
    why: str


class Undo(Struct, frozen=True):
    """The last decision is taken back, or with `again` the last taking back."""

    by: str
    again: bool = False


class Respond(Struct, frozen=True):
    """Another quantity at the ending is held against the scores."""

    response: str  # one of `solver.quantities`


class Draw(Struct, frozen=True):
    """Asks for a picture of the session."""

    name: str


class ShowHistory(Struct, frozen=True):
    """Asks for the way of one trial's finger."""

    key: Key


class ShowReadings(Struct, frozen=True):
    """Asks for the readings around one stroke."""

    stroke: int  # its number


class Compare(Struct, frozen=True):
    """Asks for another session beside this one."""

    folder: str


class Write(Struct, frozen=True):
    """Asks for a file: "report", one of `sessions.exchange.FORMATS`, or "picture NAME" of what `pictures` names."""

    what: str
    path: str


class GoOn(Struct, frozen=True):
    """What was stopped goes on."""


class Stop(Struct, frozen=True):
    """Whatever is being done is stopped."""


Ask = Choose | Move | Undo | Draw | ShowHistory | ShowReadings | Compare | Write | GoOn | Stop
Said = Step | ReportReady | Answered | Drawn | Filmed | Read | Compared | Done | Problem | Cancelled | Idle
Message = Ask | Said | Respond
