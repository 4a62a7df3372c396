"""What recorder and client say to each other: plain data, frozen, and packed as bytes on a pipe.

Beside what stands here, the client sends every event of `run.steps` (what experimenter and subject do), and the
recorder sends every command of `sessions.run.steps` (what they are asked for), each `LoggedEvent` once it is safe, and
`Status` ten times a second [session clock]. A message is a length of four bytes, then MessagePack of [name, fields].
Nothing in it can be run.
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
    """Open the transducer at this address and show what it measures; one that was open before is closed."""

    uri: str


class Disconnect(Struct, frozen=True):
    """Close the transducer."""


class Tare(Struct, frozen=True):
    """Measure the zero of the bench with nothing touching, for what is shown live. Not during a session."""

    duration: float = 1.0  # [s, device time]


class AcknowledgeOverloads(Struct, frozen=True):
    """Somebody has seen the overloads: forget the greatest loads."""


@dataclass(frozen=True, slots=True)
class People:
    """Who does what is asked for. Simulated ones need a simulated bench, or a visit that only scores.

    A simulated hand mounts nothing and judges nothing: it strokes when a stroke is asked for, and people do the rest.
    """

    kind: Kind = "people"
    seed: int = 0  # of the simulated subject
    friction: tuple[tuple[str, int, float], ...] = ()  # descriptor, index and friction of simulated surfaces [-]


class StartSession(Struct, frozen=True):
    """Begin a session in `folder`, which is made or is empty; with forces the transducer that is open records it."""

    plan: SessionPlan
    folder: str
    people: People = field(default_factory=People)
    settings: tuple[Setting, ...] = ()  # that shaped it, for its provenance
    any_folder: bool = False  # also on a network drive or in a synchronised folder; this is recorded


class ResumeSession(Struct, frozen=True):
    """Go on with the session in `folder`, that was cut short: at the same trial, with the people it began with."""

    folder: str
    uri: str | None = None  # of its transducer; None: where it was when the session began
    people: People | None = None  # None: those it began with


class Stop(Struct, frozen=True):
    """End at once what is being done, session included, with a written end."""


class Shutdown(Struct, frozen=True):
    """End the session, if one runs, then the process."""


Request = (
    Connect | Disconnect | Tare | AcknowledgeOverloads | StartSession | ResumeSession | Stop | Shutdown | steps.Event
)

# ---- from the recorder


class Device(Struct, frozen=True, eq=False):
    """The transducer is open."""

    info: TransducerInfo
    frame: Frame | None  # how its axes lie to the face, where a simulated or recorded bench knows; else None


class NoDevice(Struct, frozen=True):
    """No transducer is open now."""


class HealthReport(Struct, frozen=True):
    """Ten times a second, also where no transducer is open: a recorder that is silent for longer hangs or sleeps."""

    health: Health  # totals since the stream began
    rate: float  # readings a second over the machine's last second [Hz]; of a paced clock simulated seconds
    load: tuple[float, ...]  # (7,) the greatest since the last report, nothing subtracted [-]; nan: no rated range
    peak: tuple[float, ...]  # (7,) the same since somebody acknowledged overloads; both as `drivers.calibration.loads`
    saturated: int  # readings the device called invalid since somebody acknowledged
    silence: float = 0.0  # since the newest reading, or since the stream began; 0 where nothing need come [real s]


class Live(Struct, frozen=True, eq=False):
    """What was measured since the last such message, every reading of it; at most 60 a second."""

    stream: int  # grows where time and sequence restart
    sequence: Indices  # (n,)
    time: Array  # (n,) [s, device clock]
    received_ns: Indices  # (n,) session clock [ns]
    wrench: Array  # (n, 6) [N, N mm] of the finger on the stimulus, transducer axes, zero subtracted
    status: Indices  # (n,) 0: nothing speaks against the reading
    zero: Six  # raw units, that was subtracted: of the last tare or take; zeros where nothing was measured
    left_out: int = 0  # readings before these that were not sent, because the client did not fetch them


class Tared(Struct, frozen=True):
    """The zero of the bench was measured, and is subtracted from what is shown live from now on."""

    mean: Six  # raw units
    spread: Six  # standard deviation, raw units
    noise: Six  # standard deviation [N, N mm]
    readings: int
    duration: float  # [s]


class SessionBegun(Struct, frozen=True):
    """A session is being recorded."""

    folder: str
    plan: SessionPlan
    people: Kind
    simulated: str | None  # the sentence that heads every file, where something is simulated
    clock_offset_ns: int  # session clock minus the machine's monotonic one [ns]; a simulated clock has no offset
    factor: float  # session seconds in one real second [-]
    events: tuple[LoggedEvent, ...] = ()  # all that was recorded before, of a session that goes on


class SessionEnded(Struct, frozen=True):
    """A session has its written end; what was recorded is safe."""

    folder: str
    end: SessionEnd
    resumable: bool  # it can go on, and is not sealed by itself


class Sealing(Struct, frozen=True):
    """The sealed copy of a session is being made; the live file is whole already. The recorder is silent meanwhile."""

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
    """The transducer no longer answers. It is tried again every second."""

    sentence: str


class LinkBack(Struct, frozen=True, eq=False):
    """The transducer answers again."""

    info: TransducerInfo
    same: bool  # it is the one that was open before, set and calibrated alike


class Gone(Struct, frozen=True):
    """The recorder's process has ended; said by the client itself, once, as the last message."""

    requested: bool  # by us
    sentence: str


Report = (
    Device | NoDevice | HealthReport | Live | Tared | SessionBegun | SessionEnded | Sealing | Sealed | Failed
    | LinkDown | LinkBack | Gone | LoggedEvent | Status | steps.Command
)  # fmt: skip

REQUESTS: tuple[type, ...] = get_args(Request)
REPORTS: tuple[type, ...] = get_args(Report)


LENGTH_PREFIX = struct.Struct("<I")
_LONGEST = 256 * 2**20  # a longer message is none of ours [bytes]


class BrokenMessage(Exception):
    """What came down the pipe is no message of ours."""


class Codec:
    """Packs and unpacks messages of the types it was given; a type is known by its name."""

    def __init__(self, types: Iterable[type]) -> None:
        self._types = {cls.__name__: cls for cls in types}

    def read(self, file: IO[bytes]) -> Iterator[Any]:
        """Yield each message of a pipe until its other end goes, which may cut the last. Raises BrokenMessage."""
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

    def decode(self, body: bytes) -> Any:  # noqa: ANN401  one of the types it was given
        """Return the message of these bytes, which are without the length. Raises BrokenMessage."""
        try:
            name, fields = msgspec.msgpack.decode(body, type=tuple[str, msgspec.Raw])
            return msgspec.msgpack.decode(fields, type=self._types[name], dec_hook=_array_in)
        except (KeyError, ValueError, TypeError, msgspec.MsgspecError) as error:
            raise BrokenMessage(f"a message that is none of ours ({error})") from error


def _array_out(value: object) -> object:
    """Return an array as its kind, shape and bytes."""
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        return array.dtype.str, array.shape, array.tobytes()
    raise NotImplementedError(type(value).__name__)


def _array_in(_: type, value: Any) -> NDArray[Any]:  # noqa: ANN401  what MessagePack holds
    """Return the array that `_array_out` gave this for. Raises ValueError where it is none of numbers."""
    dtype_name, shape, content = value
    dtype = np.dtype(dtype_name)
    if dtype.kind not in "if":
        raise ValueError(f"an array of kind {dtype_name}")
    return np.frombuffer(content, dtype).reshape(shape)
