"""A USB device as a link: requests and their answers on one pair of endpoints, a stream on a third."""

import errno
from collections.abc import Sequence
from typing import Any

import usb.core
import usb.util

from drivers.transducer import LinkLost, SetupError

_core: Any = usb.core  # it has no types
_util: Any = usb.util
BACKEND: Any = None  # of pyusb: None is the system's; tests insert a simulated bus
_PACKETS = 64  # taken in one call while they arrive without a pause
_PAUSE_MS = 2
_LARGEST = 64  # bytes in a packet of a full-speed bulk endpoint
_WRITE_MS = 300


class UsbLink:
    """One device, opened exclusively. The first bytes after a request are its answer."""

    def __init__(self, device: Any, endpoints: tuple[int, int, int], location: str) -> None:  # noqa: ANN401 - no types
        """Take a device with `endpoints` for requests, answers and stream. Raises SetupError when this fails."""
        self._device = device
        self._requests, self._answers, self._stream = endpoints
        self._location = location
        self._awaits_answer = False
        try:
            try:
                device.get_active_configuration()
            except _core.USBError:
                device.set_configuration()
            _util.claim_interface(device, 0)
        except _core.USBError as error:
            _util.dispose_resources(device)
            raise SetupError(f"{location} cannot be opened: {_reason(error)}") from None

    def send(self, data: bytes) -> None:
        try:
            self._device.write(self._requests, data, _WRITE_MS)
        except _core.USBError as error:
            raise LinkLost(f"{self._location} takes no bytes any more: {_reason(error)}") from None
        self._awaits_answer = True

    def receive(self, timeout: float) -> bytes | None:
        """Return the answer to the last request, or bytes of the stream; None when nothing arrived in `timeout` s."""
        awaits = self._awaits_answer
        endpoint = self._answers if awaits else self._stream
        packets: list[bytes] = []
        wait_ms = max(round(timeout * 1000), 1)
        while len(packets) < (1 if awaits else _PACKETS):
            try:
                packets.append(bytes(self._device.read(endpoint, _LARGEST, wait_ms)))
                self._awaits_answer = False  # only now: a caller with short timeouts must still get the answer
            except _core.USBTimeoutError:
                break
            except _core.USBError as error:
                if packets:
                    break  # the next call reports it
                raise LinkLost(f"{self._location} is gone: {_reason(error)}") from None
            wait_ms = _PAUSE_MS
        return b"".join(packets) or None

    def close(self) -> None:
        _util.dispose_resources(self._device)


def devices(vendor: int, product: int) -> Sequence[Any]:
    """Return the plugged-in devices of a kind. Raises SetupError where USB cannot be used."""
    try:
        devices: Any = _core.find(find_all=True, idVendor=vendor, idProduct=product, backend=BACKEND)
        return tuple(devices)
    except _core.NoBackendError:
        raise SetupError("USB cannot be used: install the system package libusb-1.0-0 (macOS: libusb)") from None
    except _core.USBError as error:
        raise SetupError(f"USB cannot be used: {_reason(error)}") from None


def _reason(error: OSError) -> str:
    match error.errno:
        case errno.EBUSY:
            return "another program has it; end that program"
        case errno.EACCES | errno.EPERM:
            return "you may not use it; install the udev rule that LabJack gives, then put its plug in again"
        case errno.ENODEV | errno.EIO | errno.EPIPE:
            return "it was pulled out or switched off; check its plug"
        case _:
            return f"{(error.strerror or 'no reason given').lower()}; check its plug"
