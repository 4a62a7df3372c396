"""A LabJack U6 with a simulated transducer on its inputs, and a simulated USB bus with such converters for pyusb.

Commands, memory and stream follow LabJack's U6 User's Guide (sections 3.2 and 5), and are packed here only.
"""

import errno
import threading
import time
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import usb.backend
import usb.core

from drivers import usb_link
from drivers.arrays import Array, Indices
from drivers.clock import Clock
from simulators.bench import FT32831, Bench, calibration_file
from simulators.faults import Faults
from simulators.simulator import RunningSimulator, Simulator, stopwatch, unplug

_ROOM = 984  # buffer of the converter for a late computer [readings]
_NAP = 0.0005  # [real s]
_VOLTS_PER_CODE = 3.1572e-4  # of this unit, near the nominal 3.1580578e-4
_VOLTS_PER_CODE_BELOW = -3.1585e-4
_ZERO_CODE = 33519.5
_OFFSETS = np.array([0.31, -0.12, 0.85, 0.06, -0.44, 0.2])  # of the mounted gauges [V]
_NOTHING_STREAMS = 52


class LabJackU6Box:
    """One converter. Its time and the bench's begin at its creation; plugging it in switches it on."""

    def __init__(self, bench: Bench, clock: Clock, *, serial: int = 360_000_001, faults: Faults | None = None) -> None:
        self.bench = bench
        self.serial = serial
        self.now = stopwatch(clock)  # time of the box and the bench [s]
        self._faults = faults or Faults()
        self._gauges = np.linalg.inv(FT32831)  # V per N or N mm
        self._lock = threading.Lock()
        self._switch_on()

    @property
    def is_plugged(self) -> bool:
        """Whether it is plugged in; without the plug it has no power."""
        away = any(self._faults.active(fault, self.now()) for fault in ("unplug", "reboot"))
        if away:
            with self._lock:
                self._switch_on()
        return not away

    def command(self, request: bytes) -> None:
        """Take a request; its answer is ready immediately."""
        with self._lock:
            self._answer = self._respond(request)

    def answer(self) -> bytes | None:
        """Return the answer to the last request, once."""
        with self._lock:
            answer, self._answer = self._answer, None
        return answer

    def stream_packet(self, patience: float) -> bytes | None:
        """Return the next stream packet, or None without one within `patience` real seconds."""
        deadline = time.monotonic() + patience
        while True:
            with self._lock:
                self._convert()
                self._send()
                if self._outbox:
                    return self._outbox.pop(0)
            if time.monotonic() >= deadline or not self.is_plugged:
                return None
            time.sleep(_NAP)

    def _switch_on(self) -> None:
        self._answer: bytes | None = None
        self._scan: tuple[list[int], int, float] | None = None  # channels, readings per packet, scans per second
        self._streams = False
        self._buffer: list[int] = []  # codes converted and not yet sent
        self._outbox: list[bytes] = []
        self._lost_scans = 0  # scans dropped since the buffer is full
        self._report: tuple[int, int] | None = None  # position in the buffer where scans are missing, and their number

    def _respond(self, request: bytes) -> bytes:
        if request == b"\xa8\xa8":
            error = 48 if self._streams else 50 if self._scan is None else 0
            if not error:
                self._begin()
            return _short(0xA9, error)
        if request == b"\xb0\xb0":
            error = 0 if self._streams else _NOTHING_STREAMS
            self._streams = False
            return _short(0xB1, error)
        if len(request) < 8 or not _sums_agree(request):
            return b"\xb8\xb8"
        number, body = request[3], request[6:]
        if number == 0x08:
            return _long(0x08, self._identity())
        if number == 0x2D:
            return _long(0x2D, bytes(2) + self._memory(body[1])) if body[1] <= 9 else _long(0x2D, bytes([26, 0]))
        if number == 0x11:
            return _long(0x11, bytes([self._configure(body), 0]))
        return _long(number, bytes([5, 0]))

    def _identity(self) -> bytes:
        data = bytearray(32)
        data[3:5] = bytes([45, 1])  # firmware 1.45
        data[9:13] = self.serial.to_bytes(4, "little")
        data[13:15] = (6).to_bytes(2, "little")
        data[31] = 4
        return bytes(data)

    def _memory(self, block: int) -> bytes:
        """Return four numbers with 32 bits before and 32 bits after the binary point."""
        gains = (1.0, 0.1, 0.01, 0.001)
        first = 0 if block in (0, 2) else 2
        numbers = [0.0] * 4
        if block in (0, 1):
            numbers = [x for gain in gains[first : first + 2] for x in (_VOLTS_PER_CODE * gain, -10.58 * gain)]
        elif block in (2, 3):
            numbers = [x for gain in gains[first : first + 2] for x in (_VOLTS_PER_CODE_BELOW * gain, _ZERO_CODE)]
        return b"".join(round(x * 2**32).to_bytes(8, "little", signed=True) for x in numbers)

    def _configure(self, body: bytes) -> int:
        """Set up a stream; return the error code, 0 for none."""
        count, _, samples, _, _, flags = body[:6]
        interval = int.from_bytes(body[6:8], "little")
        channels = [(body[8 + 2 * i], body[9 + 2 * i]) for i in range(count)] if len(body) == 8 + 2 * count else []
        if self._streams:
            return 48
        if not channels or any(options != 0x80 or channel % 2 or channel > 10 for channel, options in channels):
            return 49
        if not 1 <= samples <= 25:
            return 56
        rate = (48e6 if flags & 8 else 4e6) / (256 if flags & 2 else 1) / max(interval, 1)
        if interval == 0 or rate * count > 50_000:
            return 58
        self._scan = ([channel // 2 for channel, _ in channels], samples, rate)
        return 0

    def _begin(self) -> None:
        self._streams = True
        self._start_time = self.now()
        self._scan_count = 0  # scans converted since the start
        self._sent = 0  # packets of this stream
        self._buffer, self._outbox, self._lost_scans, self._report = [], [], 0, None

    def _convert(self) -> None:
        """Convert due scans. A full buffer drops new ones until half of it is sent, then reports their number."""
        if not self._streams or self._scan is None:
            return
        gauges, _, rate = self._scan
        times, self._scan_count = self._faults.due(self._start_time, self.now(), rate, self._scan_count)
        room = (_ROOM - len(self._buffer)) // len(gauges)
        if self._lost_scans and self._report is None and room > _ROOM // len(gauges) // 2:
            # One scan of ones replaces the lost ones; the guide counts it among them.
            self._report = (len(self._buffer), self._lost_scans)
            self._buffer += [0xFFFF] * len(gauges)
            self._lost_scans = 0
        count = 0 if self._lost_scans else min(len(times), room)
        self._lost_scans += len(times) - count
        self._buffer += self._codes(times[:count])[:, gauges].ravel().tolist()

    def _send(self) -> None:
        """Pack a full packet; packets have error 59 while scans are missing, and 60 with their number."""
        if self._outbox or self._scan is None or len(self._buffer) < (samples := self._scan[1]):
            return
        codes, self._buffer = self._buffer[:samples], self._buffer[samples:]
        loss, error = 0, 59 if self._lost_scans else 0
        if self._report is not None:
            position, reported_loss = self._report
            self._report = (position - samples, reported_loss) if position >= samples else None
            loss, error = (0, 59) if position >= samples else (reported_loss, 60)
        error = error or self._faults.status(self.now()) & 0xFF
        data = loss.to_bytes(4, "little") + bytes([self._sent % 256, error])
        data += b"".join(code.to_bytes(2, "little") for code in codes) + bytes([min(len(self._buffer) // 4, 255), 0])
        self._sent += 1
        self._outbox += self._faults.route(self.now(), [(self.now(), _long(0xC0, data, 0xF9))])

    def _codes(self, times: Array) -> Indices:
        """Return the converter's codes of the six gauges at `times` (n,) [s], shape (n, 6)."""
        volts = self._faults.sensed_wrench(self.bench, times) @ self._gauges.T + _OFFSETS
        volts[self._faults.during("saturate", times), 2] = 11.0
        slope = np.where(volts < 0.0, -_VOLTS_PER_CODE_BELOW, _VOLTS_PER_CODE)
        return np.clip(np.rint(_ZERO_CODE + volts / slope), 0, 65535).astype(np.int64)


def _short(command: int, error: int) -> bytes:
    body = bytes([command, error, 0])
    return bytes([_checksum8(body)]) + body


def _long(number: int, data: bytes, command: int = 0xF8) -> bytes:
    header = bytes([command, len(data) // 2, number]) + (sum(data) % 65536).to_bytes(2, "little")
    return bytes([_checksum8(header)]) + header + data


def _sums_agree(request: bytes) -> bool:
    return request[0] == _checksum8(request[1:6]) and request[4:6] == (sum(request[6:]) % 65536).to_bytes(2, "little")


def _checksum8(data: bytes) -> int:
    """Return the checksum of one byte: the sum of the bytes with its carry added twice."""
    total = sum(data)
    total = total // 256 + total % 256
    return total // 256 + total % 256


_core: Any = usb.core
_Backend: Any = usb.backend.IBackend
_ENDPOINTS = (0x01, 0x82, 0x83)
# Fields of the descriptors, in the order of the USB specification.
_DEVICE = (
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 idVendor idProduct "
    "bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations"
)
_CONFIGURATION = (
    "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration bmAttributes bMaxPower"
)
_INTERFACE = (
    "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass bInterfaceSubClass "
    "bInterfaceProtocol iInterface"
)
_ENDPOINT = "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval bRefresh bSynchAddress"


def _descriptor(names: str, values: Sequence[int], **further: object) -> SimpleNamespace:
    """Return a descriptor with its fields by name, and `further` attributes for pyusb."""
    return SimpleNamespace(**dict(zip(names.split(), values, strict=True)), extra_descriptors=[], **further)


class SimulatedBus(_Backend):
    """A backend for `usb.core.find(backend=...)`. Only one handle at a time may claim a converter."""

    def __init__(self, boxes: Sequence[LabJackU6Box]) -> None:
        self._boxes = tuple(boxes)
        self._claims: dict[int, object] = {}  # by position of the box: the handle that claimed it

    def claims(self) -> int:
        """Return the number of claimed converters."""
        return len(self._claims)

    def enumerate_devices(self) -> Iterator[int]:
        return iter([number for number, box in enumerate(self._boxes) if box.is_plugged])

    def get_device_descriptor(self, dev: int) -> SimpleNamespace:
        values = 18, 1, 0x0200, 0xFF, 0, 0, 64, 0x0CD5, 0x0006, 0x0100, 0, 0, 0, 1
        return _descriptor(
            _DEVICE, values, address=dev + 1, bus=1, port_number=dev + 1, port_numbers=(dev + 1,), speed=2
        )

    def get_configuration_descriptor(self, dev: int, config: int) -> SimpleNamespace:
        if config:
            raise IndexError(config)
        return _descriptor(_CONFIGURATION, (9, 2, 39, 1, 1, 0, 0x80, 250))

    def get_interface_descriptor(self, dev: int, intf: int, alt: int, config: int) -> SimpleNamespace:
        if intf or alt or config:
            raise IndexError(alt)
        return _descriptor(_INTERFACE, (9, 4, 0, 0, len(_ENDPOINTS), 0xFF, 0, 0, 0))

    def get_endpoint_descriptor(self, dev: int, ep: int, intf: int, alt: int, config: int) -> SimpleNamespace:
        return _descriptor(_ENDPOINT, (7, 5, _ENDPOINTS[ep], 2, 64, 0, 0, 0))

    def open_device(self, dev: int) -> SimpleNamespace:
        return SimpleNamespace(place=dev)

    def close_device(self, dev_handle: SimpleNamespace) -> None:
        """Release a handle and its claim."""
        if self._claims.get(dev_handle.place) is dev_handle:
            del self._claims[dev_handle.place]

    def set_configuration(self, dev_handle: SimpleNamespace, config_value: int) -> None:
        """Accept the only configuration."""

    def get_configuration(self, dev_handle: SimpleNamespace) -> int:
        self._box(dev_handle)
        return 1

    def claim_interface(self, dev_handle: SimpleNamespace, intf: int) -> None:
        """Claim the device. Raises USBError when another handle has it."""
        self._box(dev_handle)
        if self._claims.setdefault(dev_handle.place, dev_handle) is not dev_handle:
            raise _core.USBError("Resource busy", -6, errno.EBUSY)

    def release_interface(self, dev_handle: SimpleNamespace, intf: int) -> None:
        self.close_device(dev_handle)

    def bulk_write(self, dev_handle: SimpleNamespace, ep: int, intf: int, data: Any, timeout: int) -> int:  # noqa: ANN401
        self._box(dev_handle).command(bytes(data))
        return len(data)

    def bulk_read(self, dev_handle: SimpleNamespace, ep: int, intf: int, buff: Any, timeout: int) -> int:  # noqa: ANN401
        """Fill `buff` with an answer or a stream packet. Raises USBTimeoutError without one in `timeout` ms."""
        box = self._box(dev_handle)
        data = box.answer() if ep == _ENDPOINTS[1] else box.stream_packet(timeout * 1e-3)
        if data is None:
            self._box(dev_handle)
            raise _core.USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
        buff[: len(data)] = type(buff)("B", data)
        return len(data)

    def _box(self, dev_handle: SimpleNamespace) -> LabJackU6Box:
        """Return the box of a handle. Raises USBError when it was unplugged."""
        box = cast("LabJackU6Box", self._boxes[dev_handle.place])
        if not box.is_plugged:
            self.close_device(dev_handle)
            raise _core.USBError("No such device (it may have been disconnected)", -4, errno.ENODEV)
        return box


def _start(bench: Bench, clock: Clock, faults: Faults, folder: Path) -> RunningSimulator:
    box = LabJackU6Box(bench, clock, faults=faults)
    bus = usb_link.BACKEND = SimulatedBus([box])
    uri = f"labjack-u6://?rate=300&cal={calibration_file(folder, bench.serial)}"
    return RunningSimulator(
        uri, bench, box.now, unplug(faults), bus.claims, forget=partial(setattr, usb_link, "BACKEND", None)
    )


SIMULATOR = Simulator("labjack-u6", _start, factor=2.0, statuses=(54, 55, 63), on_ports=False)  # codes in a stream
