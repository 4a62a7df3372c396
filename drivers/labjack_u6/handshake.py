"""Finding the LabJack U6 an address names, and who the transducer behind it is."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from drivers.address import Address, AddressError, check_options
from drivers.calibration_file import CalibrationFile, read_calibration_file
from drivers.clock import Clock
from drivers.labjack_u6 import device, wire
from drivers.streaming import StreamingTransducer
from drivers.transducer import DeviceFault, LinkLost, SetupError, TransducerInfo
from drivers.usb_link import Endpoints, UsbLink, found

_VENDOR, _PRODUCT = 0x0CD5, 0x0006
_ENDPOINTS = Endpoints(0x01, 0x82, 0x83)
_OPTIONS = frozenset({"serial", "cal", "rate"})


@dataclass(frozen=True, slots=True)
class _Where:
    """What an address says."""

    uri: str
    serial: int  # of the converter; 0: whichever is alone
    rate: int  # scans a second
    calibration: CalibrationFile | None


def open_labjack_u6(address: Address, clock: Clock) -> StreamingTransducer:
    """Return the transducer at `address`, identified, not streaming. Raises SetupError, LinkLost, DeviceFault."""
    place = _where(address)
    if place.calibration is None:
        raise AddressError(f"{place.uri} names no calibration; add cal=FILE, the transducer's own .cal file")
    link, identity = _linked(place)
    try:
        constants = device.constants(link)
    except (LinkLost, DeviceFault) as error:
        raise type(error)(f"{place.uri}: {error}") from None
    finally:
        link.close()
    scans = wire.scan_clock(place.rate)
    conversation = device.GaugeConversation(identity.serial, constants, scans)
    info = _info(place, place.calibration, identity, constants, scans)
    return StreamingTransducer(info, partial(_again, place, identity.serial), conversation, clock)


def identify_labjack_u6(address: Address, _patience: float) -> TransducerInfo:
    """Return who answers, changing nothing. Raises SetupError where another program has it or nothing is plugged in."""
    place = _where(address)
    link, identity = _linked(place)
    try:
        if place.calibration is None:
            raise SetupError(
                f"{place.uri}: LabJack U6 {identity.serial} is there; add cal=FILE, the transducer's own .cal file"
            )
        constants = device.constants(link)
    except (LinkLost, DeviceFault) as error:
        raise type(error)(f"{place.uri}: {error}") from None
    finally:
        link.close()
    return _info(place, place.calibration, identity, constants, wire.scan_clock(place.rate))


def _linked(place: _Where) -> tuple[UsbLink, wire.Identity]:
    """Return the one converter that is meant, open, and who it is."""
    fitting: dict[int, Any] = {}
    refused: list[SetupError] = []
    for one in found(_VENDOR, _PRODUCT):
        try:
            link = UsbLink(one, _ENDPOINTS, place.uri)
        except SetupError as error:
            refused.append(error)
            continue
        try:
            serial = device.identity(link).serial
        except (LinkLost, DeviceFault) as error:
            refused.append(SetupError(f"{place.uri}: {error}"))
            continue
        finally:
            link.close()
        if place.serial in (0, serial):
            fitting[serial] = one
    if len(fitting) > 1:
        raise SetupError(f"{place.uri}: several are plugged in; add serial= one of {', '.join(map(str, fitting))}")
    if not fitting:
        if refused:
            raise refused[0]
        which = f"LabJack U6 {place.serial}" if place.serial else "LabJack U6"
        raise LinkLost(f"{place.uri}: no {which} is plugged in; check its USB cable")
    (one,) = fitting.values()
    link = UsbLink(one, _ENDPOINTS, place.uri)
    return link, device.identity(link)


def _again(place: _Where, serial: int) -> UsbLink:
    """Open the same converter anew, wherever it is plugged in now."""
    return _linked(_Where(place.uri, serial, place.rate, place.calibration))[0]


def _info(
    place: _Where,
    file: CalibrationFile,
    identity: wire.Identity,
    constants: wire.Constants,
    scans: wire.ScanClock,
) -> TransducerInfo:
    return TransducerInfo(
        uri=place.uri,
        driver="labjack-u6",
        model=f"{file.body} {file.part_number} on LabJack U6{'-Pro' if identity.pro else ''}".strip(),
        serial=file.calibration.serial,
        simulated="SIMULATED" in file.part_number.upper(),
        rate=scans.rate,
        counter_rate=scans.rate,
        calibration=file.calibration,
        settings={
            "converter": f"serial number {identity.serial}, firmware {identity.firmware}",
            "calibration": f"{file.calibration.source}, SHA-256 {file.sha256}",
            "constants": f"{constants.positive_slope!r} V above and {constants.negative_slope!r} V below "
            f"code {constants.centre!r}, as the converter states them",
            "gauges": "differential pairs 0-1 to 10-11, +-10 V, resolution index 1, settling time its own choice",
            "bias": "none in the device",
            "filter": "none",
            "time": "the converter's own clock; gauges of one reading are converted one after the other",
        },
    )


def _where(address: Address) -> _Where:
    check_options(address, _OPTIONS)
    if address.host:
        raise AddressError(f"{address.uri}: a USB device has no host; write labjack-u6://?serial=...&cal=FILE")
    file = address.options.get("cal")
    return _Where(
        address.uri,
        address.number("serial", 0, 0, 999_999_999),
        address.number("rate", 1000, 3, wire.HIGHEST_RATE),
        None if file is None else read_calibration_file(Path(file)),
    )
