"""What the window tells its own state, beside what goes to and comes from the recorder."""

from msgspec import Struct

from daq_app.recorder import messages as m
from daq_app.recorder.device_history import Life
from daq_app.window.live_feed import Load
from daq_app.window.stroke_quality import Quality
from drivers.catalog import Probe


class Tick(Struct, frozen=True):
    """Time has passed."""

    now: float  # [s] of the machine's monotonic clock


class Searching(Struct, frozen=True):
    """Devices are being looked for."""


class DevicesFound(Struct, frozen=True):
    """What answered when devices were looked for."""

    devices: tuple[Probe, ...]


class Loaded(Struct, frozen=True):
    """How far the readings that have just come load the transducer."""

    load: Load


class LifeKnown(Struct, frozen=True):
    """What a serial number has been through was looked up."""

    serial: str
    life: Life | None


class Judged(Struct, frozen=True):
    """The last stroke was looked at."""

    trial: int
    take: int
    quality: Quality


class Dismissed(Struct, frozen=True):
    """The experimenter has read the sentence of a failure."""


class NewSession(Struct, frozen=True):
    """The experimenter leaves a session that has ended, for the page where the next is begun."""


class DrawingFailed(Struct, frozen=True):
    """A picture could not be drawn; the recording is not touched by it."""

    sentence: str


class LanguageChosen(Struct, frozen=True):
    """The language that the next session's subject reads was chosen."""

    language: str


Own = (
    Tick | Searching | DevicesFound | Loaded | LifeKnown | Judged | Dismissed | NewSession | DrawingFailed
    | LanguageChosen
)  # fmt: skip
Message = m.Request | m.Report | Own  # what `fold` takes
