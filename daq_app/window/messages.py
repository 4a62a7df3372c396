"""What the window tells its own state, beside what goes to and comes from the recorder."""

from dataclasses import dataclass

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import Life
from daq_app.window.bench_load import Load
from daq_app.window.stroke_quality import Quality
from drivers.catalog import Probe


@dataclass(frozen=True, slots=True)
class Tick:
    """Time has passed."""

    now: float  # [s] of the machine's monotonic clock


@dataclass(frozen=True, slots=True)
class Searching:
    """Devices are being looked for."""


@dataclass(frozen=True, slots=True)
class DevicesFound:
    """What answered when devices were looked for."""

    found: tuple[Probe, ...]


@dataclass(frozen=True, slots=True)
class Loaded:
    """How far the readings that have just come load the transducer."""

    load: Load


@dataclass(frozen=True, slots=True)
class LifeKnown:
    """What a serial number has been through was looked up."""

    serial: str
    life: Life | None


@dataclass(frozen=True, slots=True)
class Judged:
    """The last stroke was looked at."""

    trial: int
    take: int
    quality: Quality


@dataclass(frozen=True, slots=True)
class Dismissed:
    """The experimenter has read the sentence of a failure."""


@dataclass(frozen=True, slots=True)
class NewSession:
    """The experimenter leaves a session that has ended, for the page where the next is begun."""


@dataclass(frozen=True, slots=True)
class DrawingFailed:
    """A picture could not be drawn; the recording is not touched by it."""

    sentence: str


@dataclass(frozen=True, slots=True)
class LanguageChosen:
    """The language that the next session's subject reads was chosen."""

    language: str


Own = (
    Tick
    | Searching
    | DevicesFound
    | Loaded
    | LifeKnown
    | Judged
    | Dismissed
    | NewSession
    | DrawingFailed
    | LanguageChosen
)
Message = m.Request | m.Report | Own  # what `fold` takes
