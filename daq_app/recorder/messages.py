"""Messages between recorder and client: frozen plain data, packed as bytes on a pipe.

In addition, the client sends every event of `sessions.run.steps` (acts of experimenter and subject), and the
recorder sends every command of `sessions.run.steps` (requests to them), each `LoggedEvent` once it is safe, and
`Status` ten times a second [session clock]. A message is a length of four bytes, then MessagePack of [name, fields].
It cannot contain code.
"""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import IO, Any, Literal, cast, get_args

import msgspec
import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from drivers.arrays import Array, Indices
from drivers.transducer import Health, TransducerInfo
from sessions.plan.plan import Frame, SessionPlan
from sessions.recording import LoggedEvent, Setting
from sessions.run import steps
from sessions.run.runner import SessionEnd, Status

Six = tuple[float, float, float, float, float, float]
Kind = Literal["people", "simulated hand", "simulated people"]

# ---- to the recorder


class Connect(Struct, frozen=True):
    """Open the transducer at this address and show its readings; one that was open before is closed."""

    uri: str


class Disconnect(Struct, frozen=True):
    """Close the transducer."""


class Tare(Struct, frozen=True):
    """Measure the zero of the bench with nothing touching, for the live display. Not during a session."""

    duration: float = 1.0  # [s, device time]


class AcknowledgeOverloads(Struct, frozen=True):
    """Somebody has seen the overloads: forget the greatest loads."""


@dataclass(frozen=True, slots=True)
class People:
    """Who acts in the session. Simulated people need a simulated bench, or a visit that only scores.

    A simulated hand neither mounts nor judges: it strokes on request, and people do the rest.
    """

    kind: Kind = "people"
    seed: int = 0  # of the simulated subject
    friction: tuple[tuple[str, int, float], ...] = ()  # descriptor, index and friction of simulated surfaces [-]


class StartSession(Struct, frozen=True):
    """Begin a session in `folder`, which is new or empty; with forces, the open transducer records it."""

    plan: SessionPlan
    folder: str
    people: People = field(default_factory=People)
    settings: tuple[Setting, ...] = ()  # for its provenance
    any_folder: bool = False  # allow a network drive or a synchronised folder; this is recorded


class ResumeSession(Struct, frozen=True):
    """Resume the session in `folder` that was cut short: at the same trial, with the people it began with."""

    folder: str
    uri: str | None = None  # of its transducer; None: where it was when the session began
    people: People | None = None  # None: those it began with


class Stop(Struct, frozen=True):
    """End the current work immediately; a session gets its written end."""


class Shutdown(Struct, frozen=True):
    """End the session, if one is running, then the process."""


Request = (
    Connect | Disconnect | Tare | AcknowledgeOverloads | StartSession | ResumeSession | Stop | Shutdown | steps.Event
)

# ---- from the recorder


class Device(Struct, frozen=True, eq=False):
    """The transducer is open."""

    info: TransducerInfo
    frame: Frame | None  # orientation of its axes to the face, for a simulated or recorded bench; else None


class NoDevice(Struct, frozen=True):
    """No transducer is open now."""


class HealthReport(Struct, frozen=True):
    """Sent ten times a second, even if no transducer is open: a recorder that is silent for longer hangs or sleeps."""

    health: Health  # totals since the stream began
    rate: float  # readings per second over the last real second [Hz]; with a paced clock per simulated second
    load: tuple[float, ...]  # (7,) the greatest since the last report, nothing subtracted [-]; nan: no rated range
    peak: tuple[float, ...]  # (7,) the same since somebody acknowledged overloads; both as `drivers.calibration.loads`
    saturated: int  # readings the device marked invalid since somebody acknowledged
    silence: float = 0.0  # since the newest reading or the start of the stream; 0 if none is expected [real s]


class Live(Struct, frozen=True, eq=False):
    """All readings since the last such message; at most 60 messages a second."""

    stream: int  # increases when time and sequence restart
    sequence: Indices  # (n,)
    time: Array  # (n,) [s, device clock]
    received_ns: Indices  # (n,) session clock [ns]
    wrench: Array  # (n, 6) [N, N mm] of the finger on the stimulus, transducer axes, zero subtracted
    status: Indices  # (n,) 0: the reading is sound
    zero: Six  # subtracted [raw units], of the last tare or take; zeros if none was measured
    left_out: int = 0  # readings before these that were not sent, because the client did not fetch them


class Tared(Struct, frozen=True):
    """The zero of the bench was measured, and is subtracted from the live readings from now on."""

    mean: Six  # raw units
    spread: Six  # standard deviation, raw units
    readings: int
    duration: float  # [s]


class SessionBegun(Struct, frozen=True):
    """A session is being recorded."""

    folder: str
    plan: SessionPlan
    people: Kind
    simulated: str | None  # the sentence at the head of every file, if something is simulated
    clock_offset_ns: int  # session clock minus the machine's monotonic one [ns]; a simulated clock has no offset
    events: tuple[LoggedEvent, ...] = ()  # recorded earlier, in a resumed session


class SessionEnded(Struct, frozen=True):
    """A session has its written end, and its recording is safe."""

    folder: str
    end: SessionEnd
    resumable: bool  # it can be resumed, and is not sealed automatically


class Sealing(Struct, frozen=True):
    """The sealed copy of a session is being made, without reports meanwhile; the live file is already complete."""

    folder: str


class Sealed(Struct, frozen=True):
    """A session was sealed."""

    folder: str


class Failed(Struct, frozen=True):
    """A request could not be met; nothing else has changed."""

    request: str  # its name
    sentence: str
    kind: str = ""  # name of the exception, for an exit code


class LinkDown(Struct, frozen=True):
    """The transducer no longer answers. The recorder tries it again every second."""

    sentence: str


class LinkBack(Struct, frozen=True, eq=False):
    """The transducer answers again."""

    info: TransducerInfo
    same: bool  # the same transducer with the same settings and calibration as before


class Gone(Struct, frozen=True):
    """The recorder's process has ended; the client itself reports this, once, as the last message."""

    requested: bool  # by us
    sentence: str


Report = (
    Device | NoDevice | HealthReport | Live | Tared | SessionBegun | SessionEnded | Sealing | Sealed | Failed
    | LinkDown | LinkBack | Gone | LoggedEvent | Status | steps.Command
)  # fmt: skip

REQUESTS: tuple[type, ...] = get_args(Request)
REPORTS: tuple[type, ...] = get_args(Report)


LENGTH_PREFIX = struct.Struct("<I")
_LONGEST = 256 * 2**20  # a longer message is invalid [bytes]


class BrokenMessage(Exception):
    """The bytes from the pipe are not a valid message."""


class Codec:
    """Packs and unpacks messages of given types, identified by their names."""

    def __init__(self, types: Iterable[type]) -> None:
        self._types = {cls.__name__: cls for cls in types}

    def read(self, file: IO[bytes]) -> Iterator[Any]:
        """Yield each message of a pipe until its other end closes, perhaps within the last. Raises BrokenMessage."""
        while len(prefix := file.read(LENGTH_PREFIX.size)) == LENGTH_PREFIX.size:
            (length,) = LENGTH_PREFIX.unpack(prefix)
            if length > _LONGEST:
                raise BrokenMessage(f"a message of {length} bytes is none of ours")
            if len(body := file.read(length)) == length:
                yield self.decode(body)

    def encode(self, message: object) -> bytes:
        """Return a message as bytes, its length first."""
        body = msgspec.msgpack.encode((type(message).__name__, message), enc_hook=_array_out)
        return LENGTH_PREFIX.pack(len(body)) + body

    def decode(self, body: bytes) -> Any:  # noqa: ANN401  one of the given types
        """Return the message in these bytes, which exclude the length. Raises BrokenMessage."""
        try:
            name, fields = msgspec.msgpack.decode(body, type=tuple[str, msgspec.Raw])
            return msgspec.msgpack.decode(fields, type=self._types[name], dec_hook=_array_in)
        except (KeyError, ValueError, TypeError, msgspec.MsgspecError) as error:
            raise BrokenMessage(f"a message that is none of ours ({error})") from error


def _array_out(value: object) -> object:
    """Return an array as dtype, shape and bytes."""
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        return array.dtype.str, array.shape, array.tobytes()
    raise NotImplementedError(type(value).__name__)


def _array_in(_: type, value: Any) -> NDArray[Any]:  # noqa: ANN401  any MessagePack value
    """Return the array encoded by `_array_out`. Raises ValueError if it is not numeric."""
    dtype_name, shape, content = value
    dtype = np.dtype(dtype_name)
    if dtype.kind not in "if":
        raise ValueError(f"an array of kind {dtype_name}")
    return np.frombuffer(content, dtype).reshape(shape)
