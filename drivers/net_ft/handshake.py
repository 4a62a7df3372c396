"""Finding out who answers at a net-ft address, and setting its rate, over its web pages."""

import math
from dataclasses import dataclass

from drivers.address import Address, check_options
from drivers.links import http_get
from drivers.net_ft.configuration import Configuration, parse_configuration, true_rate
from drivers.net_ft.wire import COUNTER_RATE
from drivers.transducer import LinkLost, SetupError, TransducerInfo

PATIENCE = 3.0  # for one web page [real s]; a healthy box answers within 0.1 s
_OPTIONS = frozenset({"rdt", "tcp", "http", "rate"})


@dataclass(frozen=True, slots=True)
class Where:
    """Where a box is, and the rate asked of it."""

    address: Address
    http_port: int
    rdt_port: int
    rate: int | None  # asked for in the address [Hz]; None leaves the box as it is


def where(address: Address) -> Where:
    """Return what a net-ft address says. Raises SetupError when it is not one."""
    check_options(address, _OPTIONS)
    if not address.host:
        raise SetupError(f"{address.uri} names no host; write for example net-ft://192.168.1.1")
    address.number("tcp", 49151, 1, 65535)
    return Where(
        address,
        http_port=address.number("http", 80, 1, 65535),
        rdt_port=address.number("rdt", 49152, 1, 65535),
        rate=address.number("rate", 0, 1, int(COUNTER_RATE)) or None,
    )


def identify(place: Where, patience: float = PATIENCE) -> TransducerInfo:
    """Return who answers, changing nothing. Raises SetupError or LinkLost with the reason."""
    return _info(place, _configuration(place, patience))


def prepare(place: Where) -> TransducerInfo:
    """Set the rate where the address asks for another one, and return who answers, as read back afterwards."""
    found = _configuration(place, PATIENCE)
    if not found.streams:
        raise SetupError(f"{place.address.uri}: the box's RDT output is disabled; enable it on its Communications page")
    if place.rate is not None and not _is_rate(found, place.rate):
        path = f"/comm.cgi?comrdtrate={place.rate}"
        answer = http_get(place.address.host, place.http_port, path, PATIENCE)
        if answer.status not in (200, 302) or not _is_rate(found := _configuration(place, PATIENCE), place.rate):
            shown = "shows no rate at all" if math.isnan(found.rate) else f"stays at {found.rate:g} Hz"
            raise SetupError(
                f"{place.address.uri}: the box was asked for {place.rate} Hz but {shown}; "
                "set the rate on its Communications page"
            )
    return _info(place, found)


def answers(place: Where) -> bool:
    """Tell whether the box's web page can be read now."""
    try:
        return http_get(place.address.host, place.http_port, "/netftapi2.xml", 0.5).status == 200
    except (LinkLost, SetupError):
        return False


def _info(place: Where, found: Configuration) -> TransducerInfo:
    return TransducerInfo(
        uri=place.address.uri,
        driver="net-ft",
        model=" ".join(filter(None, (found.product, found.model))),
        serial=found.serial,
        simulated="SIMULATED" in found.product.upper(),
        rate=found.rate,
        counter_rate=COUNTER_RATE,
        calibration=found.calibration(),
        settings=found.settings,
    )


def _is_rate(found: Configuration, asked: int) -> bool:
    return math.isclose(found.rate, true_rate(asked))


def _configuration(place: Where, patience: float) -> Configuration:
    answer = http_get(place.address.host, place.http_port, "/netftapi2.xml", patience)
    if answer.status != 200:
        raise SetupError(
            f"{place.address.uri}: its web page answers {answer.status} instead of a configuration; "
            "check that the address is that of a Net F/T box"
        )
    try:
        found = parse_configuration(answer.body)
    except SetupError as error:
        raise SetupError(f"{place.address.uri}: {error}") from None
    if "axia" in found.product.lower():
        raise SetupError(f"{place.address.uri} is an Ethernet Axia, whose wire this version cannot read yet")
    return found
