"""Identification and setup of the box at a net-ft address, by its web pages and command port."""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from drivers.address import Address, Driver, check_form
from drivers.clock import Clock
from drivers.deadline import Deadline
from drivers.links import UdpLink, http_get, resolve, tcp_answer
from drivers.net_ft import wire
from drivers.net_ft.configuration import Configuration, parse_configuration, true_rate
from drivers.net_ft.device import NetFtTransducer
from drivers.net_ft.wire import COUNTER_RATE
from drivers.transducer import LinkLost, SetupError, TransducerInfo

_AT_ONCE = 0.18  # for one web page while a stream is silent, and so the longest delay of a stop [real s]
_SETTLING = 0.05  # after a bias request [real s]
_OPTIONS = frozenset({"rdt", "tcp", "http", "rate", "mode", "bias", "latch"})


@dataclass(frozen=True, slots=True)
class _Target:
    address: Address
    http_port: int
    rdt_port: int
    tcp_port: int
    rate: int | None  # requested in the address [Hz]; None leaves the box as it is
    buffered: bool  # several records in a datagram: fewer datagrams, more delay
    set_bias: bool  # the load at opening becomes zero
    reset_latch: bool  # of the monitor condition
    host: str  # its IPv4 address


def open_net_ft(address: Address, clock: Clock, deadline: Deadline) -> NetFtTransducer:
    """Return the box at `address`, set up by it, not streaming. Raises SetupError or LinkLost with the reason."""
    target = _target_of(address, deadline)
    return NetFtTransducer(
        _prepare(target, deadline),
        connect=lambda _: UdpLink(target.host, target.rdt_port),
        identify=lambda: _identify(target),
        clock=clock,
        opening=deadline,
        request=wire.START_BUFFERED if target.buffered else wire.START,
    )


def identify_net_ft(address: Address, deadline: Deadline) -> TransducerInfo:
    """Return the box's info, changing nothing. Raises SetupError or LinkLost with the reason."""
    return _configuration(_target_of(address, deadline), deadline).info


def _target_of(address: Address, deadline: Deadline) -> _Target:
    check_form(address, "net-ft://192.168.1.1", _OPTIONS)
    return _Target(
        address,
        http_port=address.number("http", 80, 1, 65535),
        rdt_port=address.number("rdt", 49152, 1, 65535),
        tcp_port=address.number("tcp", 49151, 1, 65535),
        rate=address.number("rate", 0, 1, int(COUNTER_RATE)) or None,
        buffered=address.word("mode", ("single", "buffered")) == "buffered",
        set_bias=address.word("bias", ("keep", "set")) == "set",
        reset_latch=address.word("latch", ("keep", "reset")) == "reset",
        host=resolve(address.host, deadline),
    )


def _prepare(target: _Target, deadline: Deadline) -> TransducerInfo:
    """Set up the box by the address, and return its description, read back afterwards."""
    configuration = _configuration(target, deadline)
    if not configuration.streams:
        uri = target.address.uri
        raise SetupError(f"{uri}: the box's RDT output is disabled; enable it on its Communications page")
    if target.rate is not None and not _is_rate(configuration.info, target.rate):
        answer = http_get(target.host, target.http_port, f"/comm.cgi?comrdtrate={target.rate}", deadline)
        if answer.status in (200, 302):
            configuration = _configuration(target, deadline)
        rate = configuration.info.rate
        if not _is_rate(configuration.info, target.rate):
            state = "shows no rate at all" if math.isnan(rate) else f"stays at {rate:g} Hz"
            raise SetupError(
                f"{target.address.uri}: the box was asked for {target.rate} Hz but {state}; "
                "set the rate on its Communications page"
            )
    results = _command(target, configuration, deadline) if target.set_bias or target.reset_latch else {}
    if target.buffered:
        results["streaming"] = "buffered"
    return replace(configuration.info, settings={**configuration.info.settings, **results})


def _command(target: _Target, configuration: Configuration, deadline: Deadline) -> dict[str, str]:
    """Send the commands in the address, and return their results for the record."""
    units = wire.parse_units(_tcp(target, wire.READ_UNITS, 24, deadline))
    if units is None or (units.counts_per_force, units.counts_per_torque) != configuration.counts:
        raise SetupError(
            f"{target.address.uri}: the box's command port does not count as its web page says; check the tcp port"
        )
    results: dict[str, str] = {}
    if target.reset_latch:
        _wrench(target, wire.RESET_LATCH, deadline)
        still = wire.is_latched(_tcp(target, wire.READ_WRENCH, 16, deadline))
        read_back = "and latched again: its condition holds" if still else "and read back as not latched"
        results["monitor condition latch"] = f"reset at opening, as the address asks, {read_back}"
    if target.set_bias:
        _wrench(target, wire.SET_BIAS, deadline)
        time.sleep(_SETTLING)
        counts = np.array(_wrench(target, wire.READ_WRENCH, deadline)) * np.array(units.scales)
        force, torque = np.abs(configuration.info.calibration.matrix @ counts).reshape(2, 3).max(axis=1)
        results["software bias"] = (
            f"set at opening, as the address asks; at most {force:.3g} N and {torque:.3g} N mm left"
        )
    return results


def _wrench(target: _Target, command: bytes, deadline: Deadline) -> tuple[int, ...]:
    counts = wire.parse_wrench(_tcp(target, command, 16, deadline))
    if counts is None:
        raise SetupError(f"{target.address.uri}: its command port gives no answer that can be read; check the tcp port")
    return counts


def _tcp(target: _Target, command: bytes, size: int, deadline: Deadline) -> bytes:
    return tcp_answer(target.host, target.tcp_port, command, size, deadline)


def _identify(target: _Target) -> TransducerInfo | None:
    """Return the box's info if it answers quickly, else None. Raises SetupError when its page is invalid."""
    try:
        return _configuration(target, Deadline(_AT_ONCE)).info
    except LinkLost:
        return None


def _is_rate(info: TransducerInfo, rate: int) -> bool:
    return math.isclose(info.rate, true_rate(rate, info.counter_rate))


def _configuration(target: _Target, deadline: Deadline) -> Configuration:
    answer = http_get(target.host, target.http_port, "/netftapi2.xml", deadline)
    if answer.status != 200:
        raise SetupError(
            f"{target.address.uri}: its web page answers {answer.status} instead of a configuration; "
            "check that the address is that of a Net F/T box or an Ethernet Axia"
        )
    try:
        return parse_configuration(answer.body, target.address.uri)
    except SetupError as error:
        raise SetupError(f"{target.address.uri}: {error}") from None


DRIVER = Driver("net-ft", open_net_ft, identify_net_ft, ("net-ft://192.168.1.1",))
