"""The LabJack U6: opening by address, and the exchange around a stream of six gauge voltages."""

import contextlib
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from drivers.address import Address, AddressError, Driver, check_form, prefix_failures
from drivers.calibration_file import CalibrationFile, read_calibration_file
from drivers.clock import Clock
from drivers.clock_recovery import ScanCount
from drivers.deadline import Deadline, Link
from drivers.labjack_u6 import wire
from drivers.readings import RecordDecoder
from drivers.streaming import StreamingTransducer
from drivers.transducer import DeviceFault, LinkLost, SetupError, TransducerInfo
from drivers.usb_link import UsbLink, devices

_ANSWER = 1.0  # for an answer [real s], as in the maker's own driver
_WRAP = 256 * wire.SCANS  # scans after which the packet counter restarts
_VENDOR, _PRODUCT = 0x0CD5, 0x0006
_ENDPOINTS = 0x01, 0x82, 0x83
_OPTIONS = frozenset({"serial", "cal", "rate"})


@dataclass(frozen=True, slots=True)
class _Target:
    uri: str
    serial: int  # of the converter; 0: the only one connected
    rate: int  # scans a second
    calibration: CalibrationFile | None


def open_labjack_u6(address: Address, clock: Clock, deadline: Deadline) -> StreamingTransducer:
    """Return the transducer at `address`, identified, not streaming. Raises SetupError, LinkLost, DeviceFault."""
    target = _target_of(address)
    if target.calibration is None:
        raise AddressError(f"{target.uri} names no calibration; add cal=FILE, the transducer's own .cal file")
    link, identity = _open_link(target, deadline)
    with prefix_failures(address), contextlib.closing(link):
        constants = _constants(deadline.bound(link))
    scans = wire.scan_clock(target.rate)
    conversation = _GaugeConversation(identity.serial, constants, scans)
    info = _info(target, target.calibration, identity, constants, scans)
    target = replace(target, serial=identity.serial)  # found again at any USB port
    return StreamingTransducer(info, lambda limit: _open_link(target, limit)[0], conversation, clock, opening=deadline)


def identify_labjack_u6(address: Address, deadline: Deadline) -> TransducerInfo:
    """Return the transducer's info, changing nothing. Raises SetupError where it is in use, LinkLost if absent."""
    target = _target_of(address)
    link, identity = _open_link(target, deadline)
    with prefix_failures(address), contextlib.closing(link):
        if target.calibration is None:
            raise SetupError(
                f"{target.uri}: LabJack U6 {identity.serial} is there; add cal=FILE, the transducer's own .cal file"
            )
        constants = _constants(deadline.bound(link))
    return _info(target, target.calibration, identity, constants, wire.scan_clock(target.rate))


def _open_link(target: _Target, deadline: Deadline) -> tuple[UsbLink, wire.Identity]:
    """Open the converter that the address names, and return its link and identity."""
    matches: dict[int, tuple[Any, wire.Identity]] = {}
    refusals: list[SetupError] = []
    for device in devices(_VENDOR, _PRODUCT):
        try:
            link = UsbLink(device, _ENDPOINTS, target.uri)
        except SetupError as error:
            refusals.append(error)
            continue
        try:
            identity = _identity(deadline.bound(link))
        except (LinkLost, DeviceFault) as error:
            refusals.append(SetupError(f"{target.uri}: {error}"))
            continue
        finally:
            link.close()
        if target.serial in (0, identity.serial):
            matches[identity.serial] = device, identity
    if len(matches) > 1:
        raise SetupError(f"{target.uri}: several are plugged in; add serial= one of {', '.join(map(str, matches))}")
    if not matches:
        if refusals:
            raise refusals[0]
        name = f"LabJack U6 {target.serial}" if target.serial else "LabJack U6"
        raise LinkLost(f"{target.uri}: no {name} is plugged in; check its USB cable")
    ((device, identity),) = matches.values()
    return UsbLink(device, _ENDPOINTS, target.uri), identity


def _info(
    target: _Target, file: CalibrationFile, identity: wire.Identity, constants: wire.Constants, scans: wire.ScanClock
) -> TransducerInfo:
    return TransducerInfo(
        uri=target.uri,
        driver="labjack-u6",
        model=f"{file.body} {file.part_number} on LabJack U6{'-Pro' if identity.pro else ''}".strip(),
        serial=file.calibration.serial,
        simulated="SIMULATED" in file.part_number.upper(),
        rate=scans.rate,
        counter_rate=scans.rate,
        calibration=file.calibration,
        status=wire.STATUS_BITS,
        settings={
            "converter": f"serial number {identity.serial}, firmware {identity.firmware}",
            "calibration": f"{file.calibration.source}, SHA-256 {file.sha256}",
            "constants": f"{constants.positive_slope!r} V above and {constants.negative_slope!r} V below "
            f"code {constants.centre!r}, as the converter states them",
            "gauges": "differential pairs 0-1 to 10-11, +-10 V, resolution index 1, settling time its own choice; "
            "accepted when a stream begins, and not to be read back",
            "bias": "none in the device",
            "filter": "none",
            "time": "the converter's own clock; gauges of one reading are converted one after the other",
        },
    )


def _target_of(address: Address) -> _Target:
    check_form(address, "labjack-u6://?serial=...&cal=FILE", _OPTIONS)
    file = address.options.get("cal")
    return _Target(
        address.uri,
        address.number("serial", 0, 0, 999_999_999),
        address.number("rate", 1000, 3, wire.HIGHEST_RATE),
        None if file is None else read_calibration_file(Path(file)),
    )


@dataclass(eq=False)
class _GaugeConversation:
    """The exchange with one converter. Each request is answered before anything else arrives."""

    serial: int
    constants: wire.Constants
    scan_clock: wire.ScanClock
    numbering = staticmethod(partial(ScanCount, wrap=_WRAP))

    def decoder(self) -> RecordDecoder:
        return wire.StreamDecoder(self.constants)

    def begin(self, link: Link) -> bytes:
        """End any stream, configure the scans and start them. Raises LinkLost or DeviceFault with the reason."""
        self.end(link)
        identity = _identity(link)
        if identity.serial != self.serial:
            raise DeviceFault(f"converter {identity.serial} answers where {self.serial} was; open it anew")
        wire.check_configuration(_reply(link, wire.configure_stream(self.scan_clock)))
        if code := wire.normal_error(_reply(link, wire.START), 0xA9):
            raise DeviceFault(f"the converter does not stream: {wire.meaning(code)}; pull its plug and put it in again")
        return b""

    def end(self, link: Link) -> None:
        """End the stream and drop its remaining bytes."""
        code = wire.normal_error(_reply(link, wire.STOP), 0xB1)
        if code not in (0, wire.STREAM_IS_OFF):
            raise DeviceFault(f"the converter does not stop: {wire.meaning(code)}; pull its plug")
        while link.receive(0.002):
            pass


def _identity(link: Link) -> wire.Identity:
    """Return the converter's identity. Raises LinkLost or DeviceFault without a valid answer."""
    return wire.parse_identity(_reply(link, wire.read_identity()))


def _constants(link: Link) -> wire.Constants:
    """Return the converter's own calibration. Raises LinkLost or DeviceFault when it has none."""
    return wire.parse_constants(_reply(link, wire.read_memory(0)), _reply(link, wire.read_memory(2)))


def _reply(link: Link, request: bytes) -> bytes:
    """Return the answer to a request. Raises LinkLost without one."""
    link.send(request)
    answer = link.receive(_ANSWER)
    if answer is None:
        raise LinkLost("the converter does not answer; pull its plug and put it in again")
    return answer


DRIVER = Driver("labjack-u6", open_labjack_u6, identify_labjack_u6, ("labjack-u6://",))
