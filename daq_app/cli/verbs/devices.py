"""List the transducers that can be reached now, or open one and print its health and noise for 3 s.

Listing only queries the devices' usual addresses and those given; a device in use is not disturbed. Serial ports are
listed without being opened.
"""

import argparse
from dataclasses import asdict
from typing import Any

import numpy as np

from daq_app.console import DONE, FLAWED, Console, WrongValue, table
from daq_app.recorder.device_history import Life, life_of
from daq_app.simulation.wiring import connect
from daq_app.wording import COUNT_LABELS, number
from drivers.calibration_file import AXES
from drivers.catalog import DRIVERS, Probe, reachable
from drivers.clock import Clock, RealClock
from drivers.readings import ReadingBlock
from drivers.serial_link import serial_ports
from drivers.transducer import Transducer, flagged_words
from sessions.recording.head import identity

EXAMPLE = "daq-app devices probe sim:"
_FLAWS = ("lost", "malformed", "stalled", "saturated", "doubtful", "off_rate", "off_units")  # counts of Health
PROBED = 3.0  # how long a probe listens [s]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    meaning = "further addresses to query; or 'probe URI' to open that one and listen"
    parser.add_argument("words", nargs="*", metavar="URI", help=meaning)


def run(options: argparse.Namespace, console: Console) -> int:
    if options.words[:1] == ["probe"]:
        if len(options.words) != 2:
            raise WrongValue("'devices probe' takes one address, for example sim: or net-ft://192.168.1.1")
        return _probe(options.words[1], console)
    devices = reachable(options.words)
    lines = serial_ports()
    documents = [_description(device) for device in devices] + [{"uri": "sim:", "simulated": True}]
    console.result(devices=documents, serial_ports=lines)
    rows = [
        [device.uri, device.info.model, device.info.serial, device.info.calibration.source]
        if device.info
        else [device.uri, "–", "–", "no answer"]
        for device in devices
    ]
    rows.append(["sim:", "simulated bench", "–", "always available"])
    console.say(table(rows, header=["address", "model", "serial", "calibration"]))
    for line in lines:
        addresses = " or ".join(f"{driver.name}://{line}" for driver in DRIVERS if driver.serial_line)
        console.say(f"{line} is a serial port, which was not opened: try it as {addresses}")
    for device in devices:
        if device.problem:
            problem = device.problem.removeprefix(f"{device.uri}: ")
            console.say(problem if device.uri in problem else f"{device.uri}: {problem}")
        if device.info is not None and (life := life_of(device.info.serial)) is not None:
            console.say(f"{device.info.serial}: {_life_text(life)}")
    return DONE


def _description(device: Probe) -> dict[str, Any]:
    if device.info is None:
        return {"uri": device.uri, "problem": device.problem}
    life = life_of(device.info.serial)
    return {**identity(device.info), "calibration": device.info.calibration.source, "life": life and asdict(life)}


def _life_text(life: Life) -> str:
    overloads = f"{life.overloads} overloads, the last on {life.last_overload}" if life.overloads else "no overload"
    if not life.zeros:
        return f"{overloads} since its first use here"
    drift, noise = max(map(abs, life.drift[:3])), max(life.noise[:3])
    zeros = f"zero moved by at most {number(drift, 2)} N since {life.since} ({life.zeros} zeros)"
    return f"{zeros}, noise at rest {number(noise, 2)} N, {overloads}"


def _probe(uri: str, console: Console) -> int:
    clock = RealClock()
    with connect(uri, clock) as bench:
        transducer = bench.transducer
        readings = _listen(transducer, clock, console)
        health, info = transducer.health, transducer.info
    wrench = info.calibration.wrench(readings.raw, np.zeros(6))
    mean: list[float] | None = wrench.mean(axis=0).tolist() if len(readings) > 1 else None
    noise: list[float] | None = wrench.std(axis=0, ddof=1).tolist() if len(readings) > 1 else None
    units = ["N"] * 3 + ["N mm"] * 3
    console.result(
        **identity(info) | {"uri": uri},
        measured_rate=_measured_rate(readings),
        settings=dict(info.settings),
        health=asdict(health),
        mean=mean,
        noise=noise,
        units=units,
    )
    counts = ", ".join(f"{label} {getattr(health, name)}" for name, label in COUNT_LABELS.items())
    console.say(
        f"{info.model}, serial {info.serial}, {number(info.rate, 4)} Hz set",
        f"calibration: {info.calibration.source}",
        f"measured {number(_measured_rate(readings), 5)} Hz on the session's clock",
        f"{counts}, lag {health.lag_ms:.1f} ms",
        f"status of the readings: {flagged_words(health.flagged)}" if health.flagged else None,
        health.rate_words or None,
    )
    if mean is not None and noise is not None:
        columns = zip(AXES, mean, noise, units, strict=True)
        rows = [[axis, number(mean_value), number(sd, 2), unit] for axis, mean_value, sd, unit in columns]
        console.say(table(rows, header=["axis", "mean", "noise (sd)", "unit"]))
    return FLAWED if any(getattr(health, name) for name in _FLAWS) or not len(readings) else DONE


def _listen(transducer: Transducer, clock: Clock, console: Console) -> ReadingBlock:
    transducer.start()
    start = clock.now_ns()
    blocks: list[ReadingBlock] = []
    while (elapsed_s := (clock.now_ns() - start) / 1e9) < PROBED:
        console.progress(elapsed_s / PROBED, f"listening, {transducer.health.received} readings")
        blocks.append(transducer.read(0.1))
    transducer.stop()
    return ReadingBlock.concatenate(blocks)


def _measured_rate(readings: ReadingBlock) -> float | None:
    """Return the rate [Hz] by regression of arrival on sequence, None if it cannot be fitted."""
    if len(readings) < 10:
        return None
    numbers, arrivals = readings.sequence - readings.sequence[0], readings.received_ns - readings.received_ns[0]
    slope = np.polynomial.Polynomial.fit(numbers, arrivals / 1e9, 1).convert().coef[1]
    return 1.0 / slope if slope > 0 else None
