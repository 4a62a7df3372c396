"""A USB bus with simulated converters on it, as pyusb sees one."""

import errno
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import usb.backend  # pyright: ignore[reportMissingTypeStubs]
import usb.core  # pyright: ignore[reportMissingTypeStubs]

from drivers import usb_link
from drivers.clock import Clock
from simulators.bench import Bench
from simulators.faults import Faults
from simulators.gauges import calibration_file
from simulators.labjack_u6_box import LabJackU6Box
from simulators.simulator import Simulated, Simulator, unplug

_core: Any = usb.core
_Backend: Any = usb.backend.IBackend
_ENDPOINTS = (0x01, 0x82, 0x83)
# Fields of the descriptors, as the USB specification names and orders them.
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
    """Return a descriptor with its fields by name, and what pyusb wants `further`."""
    return SimpleNamespace(**dict(zip(names.split(), values, strict=True)), extra_descriptors=[], **further)


class SimulatedBus(_Backend):
    """What `usb.core.find(backend=...)` takes. One handle at a time may hold a converter."""

    def __init__(self, boxes: Sequence[LabJackU6Box]) -> None:
        """Put the boxes on the bus."""
        self._boxes = tuple(boxes)
        self._claims: dict[int, object] = {}  # by the box's place: the handle that claimed it

    def claims(self) -> int:
        """Return how many converters somebody holds."""
        return len(self._claims)

    def enumerate_devices(self) -> Iterator[int]:
        """Return the places at which something is plugged in."""
        return iter([place for place, box in enumerate(self._boxes) if box.is_plugged])

    def get_device_descriptor(self, dev: int) -> SimpleNamespace:
        """Return what a U6 tells of itself."""
        values = 18, 1, 0x0200, 0xFF, 0, 0, 64, 0x0CD5, 0x0006, 0x0100, 0, 0, 0, 1
        return _descriptor(
            _DEVICE, values, address=dev + 1, bus=1, port_number=dev + 1, port_numbers=(dev + 1,), speed=2
        )

    def get_configuration_descriptor(self, dev: int, config: int) -> SimpleNamespace:
        """Return the only configuration."""
        if config:
            raise IndexError(config)
        return _descriptor(_CONFIGURATION, (9, 2, 39, 1, 1, 0, 0x80, 250))

    def get_interface_descriptor(self, dev: int, intf: int, alt: int, config: int) -> SimpleNamespace:
        """Return the only interface."""
        if intf or alt or config:
            raise IndexError(alt)
        return _descriptor(_INTERFACE, (9, 4, 0, 0, len(_ENDPOINTS), 0xFF, 0, 0, 0))

    def get_endpoint_descriptor(self, dev: int, ep: int, intf: int, alt: int, config: int) -> SimpleNamespace:
        """Return one of the three bulk endpoints."""
        return _descriptor(_ENDPOINT, (7, 5, _ENDPOINTS[ep], 2, 64, 0, 0, 0))

    def open_device(self, dev: int) -> SimpleNamespace:
        """Return a handle."""
        return SimpleNamespace(place=dev)

    def close_device(self, dev_handle: SimpleNamespace) -> None:
        """Give a handle back, and what it holds."""
        if self._claims.get(dev_handle.place) is dev_handle:
            del self._claims[dev_handle.place]

    def set_configuration(self, dev_handle: SimpleNamespace, config_value: int) -> None:
        """Take the only configuration."""

    def get_configuration(self, dev_handle: SimpleNamespace) -> int:
        """Return the configuration that is active."""
        self._box(dev_handle)
        return 1

    def claim_interface(self, dev_handle: SimpleNamespace, intf: int) -> None:
        """Hold the device. Raises USBError when another handle does."""
        self._box(dev_handle)
        if self._claims.setdefault(dev_handle.place, dev_handle) is not dev_handle:
            raise _core.USBError("Resource busy", -6, errno.EBUSY)

    def release_interface(self, dev_handle: SimpleNamespace, intf: int) -> None:
        """Let go."""
        self.close_device(dev_handle)

    def bulk_write(self, dev_handle: SimpleNamespace, ep: int, intf: int, data: Any, timeout: int) -> int:  # noqa: ANN401
        """Send a request."""
        self._box(dev_handle).command(bytes(data))
        return len(data)

    def bulk_read(self, dev_handle: SimpleNamespace, ep: int, intf: int, buff: Any, timeout: int) -> int:  # noqa: ANN401
        """Fill `buff` with an answer or a stream packet. Raises USBTimeoutError when there is none in `timeout` ms."""
        box = self._box(dev_handle)
        data = box.answer() if ep == _ENDPOINTS[1] else box.streamed(timeout * 1e-3)
        if data is None:
            self._box(dev_handle)
            raise _core.USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
        buff[: len(data)] = type(buff)("B", data)
        return len(data)

    def is_kernel_driver_active(self, dev_handle: SimpleNamespace, intf: int) -> bool:
        """Tell that the system has no driver for it."""
        return False

    def _box(self, dev_handle: SimpleNamespace) -> LabJackU6Box:
        """Return the box of a handle. Raises USBError when it was pulled out."""
        box = cast("LabJackU6Box", self._boxes[dev_handle.place])
        if not box.is_plugged:
            self.close_device(dev_handle)
            raise _core.USBError("No such device (it may have been disconnected)", -4, errno.ENODEV)
        return box


def _start(bench: Bench, clock: Clock, faults: Faults, folder: Path) -> Simulated:
    box = LabJackU6Box(bench, clock, faults=faults)
    bus = usb_link.BACKEND = SimulatedBus([box])
    uri = f"labjack-u6://?rate=300&cal={calibration_file(folder, f'SIM{bench.seed:05d}')}"

    def forget() -> None:
        usb_link.BACKEND = None

    return Simulated(uri, bench, box.now, unplug(faults), bus.claims, forget)


SIMULATOR = Simulator("labjack-u6", _start, factor=2.0, statuses=(54, 55, 63))  # codes in a stream
