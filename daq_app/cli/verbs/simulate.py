"""Serve a simulated device on this computer, to try a driver (ours or any other) without hardware.

The networked force/torque box (net-ft) speaks UDP, TCP and HTTP on loopback, on the device's own ports by
default, and on a free HTTP port where 80 is refused. The stand-alone controller (serial-ft) and the RS-485 transducer
(digital-ft) use a pseudo-terminal of Linux or macOS. Without --script the paper's ten surfaces are stroked repeatedly.
"""

import argparse
import time
from pathlib import Path

from daq_app.cli.options import add_number, add_seed
from daq_app.console import Console, WrongValue
from daq_app.simulation.wiring import WIRES, load_timetable, serve
from sessions.plan.protocols.protocol import LARGEST_SEED

EXAMPLE = "daq-app simulate net-ft --rdt-port 50000 --tcp-port 50001 --http-port 8080"
_BAUDS = (4800, 9600, 19200, 38400, 57600, 115200)
PORTS = {"rdt_port": 49152, "tcp_port": 49151, "http_port": None}  # of net-ft, by default
_FAULTS_OF_NET_FT = ("units", "steal")  # that other wires cannot show
OF_ONE_WIRE = {**dict.fromkeys((*PORTS, "rate"), "net-ft"), "baud": "serial-ft"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("wire", choices=WIRES)
    parser.add_argument("--port", "--rdt-port", type=_port, dest="rdt_port", help="UDP port (49152)")
    parser.add_argument("--tcp-port", type=_port, help="TCP command port (49151)")
    parser.add_argument("--http-port", type=_port, help="HTTP port (80, or a free one)")
    allowed = "the box gives 1 to 7000 readings per second"
    add_number(parser, "--rate", int, (1, 7000), "readings per second of net-ft, 1 to 7000 (200)", allowed=allowed)
    parser.add_argument("--baud", type=int, help="line speed of serial-ft in bits per second (38400)")
    add_seed(parser, "seed of noise, drift and strokes (0)", largest=LARGEST_SEED)
    add_number(parser, "--factor", float, (0.01, 1000.0), "speed relative to real time (1)", 1.0)
    parser.add_argument("--script", type=Path, help="TOML timetable of strokes and faults")


def run(options: argparse.Namespace, console: Console) -> int:
    settings = {name: getattr(options, name) for name in OF_ONE_WIRE if getattr(options, name) is not None}
    for name in settings:
        if OF_ONE_WIRE[name] != options.wire:
            raise WrongValue(f"--{name.replace('_', '-')} belongs to {OF_ONE_WIRE[name]}, not to {options.wire}")
    if settings.get("baud", 9600) not in _BAUDS:
        raise WrongValue(f"--baud {options.baud} is not allowed: one of {', '.join(map(str, _BAUDS))}")
    if options.wire == "net-ft":
        settings["ports"] = tuple(settings.pop(name, usual) for name, usual in PORTS.items())
    timetable = None if options.script is None else load_timetable(options.script)
    for fault in () if timetable is None or options.wire == "net-ft" else timetable.faults:
        if fault.kind in _FAULTS_OF_NET_FT:
            raise WrongValue(f"{options.script}: the fault {fault.kind!r} belongs to net-ft, not to {options.wire}")
    box = serve(options.wire, **settings, seed=options.seed, factor=options.factor, timetable=timetable)
    try:
        console.result(address=box.uri, simulated=True)
        console.say(f"SIMULATED {options.wire} at {box.uri}")
        console.note("serving until Ctrl-C")
        while True:
            time.sleep(0.1)
    finally:
        box.close()


def _port(text: str) -> int:
    if not (text.isdecimal() and 0 <= int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text} is not a port: give a number from 0 (any free port) to 65535")
    return int(text)
