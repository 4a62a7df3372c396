"""Finding out who answers at a digital-ft address."""

import math
from dataclasses import dataclass
from functools import partial

from drivers.address import Address, check_options
from drivers.clock import Clock
from drivers.digital_ft import device, wire
from drivers.digital_ft.device import DigitalConversation
from drivers.pacing import GAP
from drivers.serial_link import Parity, SerialLink, port_of
from drivers.streaming import StreamingTransducer, measured_rate
from drivers.transducer import DeviceFault, LinkLost, SetupError, TransducerInfo

_MEASURED = 0.5  # for how long the stream is watched to learn its rate [real s]
_AS_STATED = 0.03  # a measured rate this near to the stated one is that [-]
_OPTIONS = frozenset({"baud", "parity", "calibration"})


@dataclass(frozen=True, slots=True)
class _Where:
    """What an address says."""

    address: Address
    port: str
    baud: int
    parity: Parity
    number: int  # of the calibration, 1 to 16


def open_digital_ft(address: Address, clock: Clock) -> StreamingTransducer:
    """Return the transducer at `address`, its calibration in force, not streaming.

    Raises SetupError, LinkLost or DeviceFault with the reason.
    """
    place = _where(address)
    connect = partial(SerialLink, place.port, place.baud, place.parity)
    link = connect()
    try:
        device.hold(link)
        stored, status = _stored(place, link), device.status(link)
        conversation = DigitalConversation(place.number, stored)
        rate = measured_rate(link, conversation, clock, _MEASURED)
    except (LinkLost, DeviceFault) as error:
        raise type(error)(f"{address.uri}: {error}") from None
    finally:
        link.close()
    return StreamingTransducer(_info(place, stored, status, rate), connect, conversation, clock)


def identify_digital_ft(address: Address, _patience: float) -> TransducerInfo:
    """Return who answers, changing nothing: a stream left over from before goes on. An answer takes 0.2 s at most."""
    place = _where(address)
    link = SerialLink(place.port, place.baud, place.parity)
    try:
        status = device.status(link)
        if status is None:
            streams = link.receive(0.05) is not None
            raise LinkLost("it streams, and nobody reads; open it to end that" if streams else "no transducer answers")
        return _info(place, _stored(place, link), status, math.nan)
    except (LinkLost, DeviceFault) as error:
        raise type(error)(f"{address.uri}: {error}") from None
    finally:
        link.close()


def _stored(place: _Where, link: SerialLink) -> wire.StoredCalibration:
    registers = device.read(link, wire.calibration_address(place.number), wire.CALIBRATION_SIZE)
    try:
        return wire.parse_calibration(registers)
    except SetupError as error:
        raise SetupError(f"{place.address.uri}: calibration {place.number} {error}") from None


def _info(place: _Where, stored: wire.StoredCalibration, status: int | None, measured: float) -> TransducerInfo:
    as_stated = math.isnan(measured) or abs(measured / wire.STREAM_RATE - 1.0) < _AS_STATED
    day = stored.calibrated or "on a day not stated"
    settings = {
        "line": f"{place.baud} baud, 8 data bits, parity {place.parity}, 1 stop bit",
        "calibration": f"number {place.number}, {stored.part_number}, calibrated {day}",
        "gauge gains and offsets": stored.gains_and_offsets.hex(" ", 2),
        "bias": "none in the transducer",
        "filter": "none",
        "time": "host arrival at the stated rate; packets carry no clock or number, "
        f"and a loss shorter than {GAP:g} s that leaves no broken bytes is not noticed",
    }
    if status is not None:
        settings["status at opening"] = "; ".join(wire.status_words(status)) or "healthy"
    if not math.isnan(measured):
        how = "as stated by the maker to 0.5 %" if as_stated else "as measured, not as stated by the maker"
        settings["rate"] = f"{how}; {measured:.0f} Hz measured at opening"
    return TransducerInfo(
        uri=place.address.uri,
        driver="digital-ft",
        model=f"Digital F/T {stored.part_number}".strip(),
        serial=stored.calibration.serial,
        simulated="SIMULATED" in stored.part_number.upper(),
        rate=wire.STREAM_RATE if as_stated else measured,
        counter_rate=math.nan,
        calibration=stored.calibration,
        settings=settings,
    )


def _where(address: Address) -> _Where:
    """Return what a digital-ft address says. Raises SetupError when it is not one."""
    check_options(address, _OPTIONS)
    parity = address.options.get("parity", "even")
    if parity not in ("even", "none"):
        raise SetupError(f"{address.uri}: parity={parity} must be even, as the transducer's, or none")
    return _Where(
        address,
        port_of(address),
        address.number("baud", 1_250_000, 300, 4_000_000),
        parity,
        address.number("calibration", 1, 1, wire.CALIBRATIONS),
    )
