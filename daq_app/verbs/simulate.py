"""Serve the other end of a wire on this computer, to try a driver (ours or anybody's) without hardware.

The networked force/torque box speaks UDP, TCP and HTTP on loopback, on the device's own ports unless told otherwise,
and on a free HTTP port where 80 is refused. Without a script the paper's ten surfaces are stroked again and again.
"""

import argparse
import time
from pathlib import Path

from daq_app.cli import WrongValue
from daq_app.console import Console
from daq_app.wiring import serve_net_ft

EXAMPLE = "daq-app simulate net-ft --rdt-port 50000 --tcp-port 50001 --http-port 8080"
WIRES = ("net-ft",)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the wire, its ports and what happens on it."""
    parser.add_argument("wire", choices=WIRES)
    parser.add_argument("--port", "--rdt-port", type=_port, default=49152, dest="rdt_port", help="UDP port (49152)")
    parser.add_argument("--tcp-port", type=_port, default=49151, help="TCP command port (49151)")
    parser.add_argument("--http-port", type=_port, default=None, help="HTTP port (80, or a free one)")
    parser.add_argument("--rate", type=int, default=200, help="readings a second, 1 to 7000 (200)")
    parser.add_argument("--seed", type=int, default=0, help="of noise, drift and strokes (0)")
    parser.add_argument("--factor", type=float, default=1.0, help="how much faster than real time runs (1)")
    parser.add_argument("--script", type=Path, help="TOML timetable of strokes and faults")


def run(options: argparse.Namespace, console: Console) -> int:
    """Serve until Ctrl-C."""
    if not 1 <= options.rate <= 7000:
        raise WrongValue(f"--rate {options.rate} is not allowed: the box gives 1 to 7000 readings a second")
    if not 0.01 <= options.factor <= 1000:
        raise WrongValue(f"--factor {options.factor:g} is not allowed: 0.01 to 1000")
    box = serve_net_ft(
        rdt_port=options.rdt_port,
        tcp_port=options.tcp_port,
        http_port=options.http_port,
        rate=options.rate,
        seed=options.seed,
        factor=options.factor,
        script=options.script,
    )
    try:
        console.result({"address": box.uri, "simulated": True})
        console.say(f"SIMULATED {options.wire} at {box.uri}")
        console.note("serving until Ctrl-C")
        while True:
            time.sleep(0.1)
    finally:
        box.close()


def _port(text: str) -> int:
    if not (text.isdecimal() and 0 <= int(text) <= 65535):
        raise argparse.ArgumentTypeError(f"{text} is no port: give a number from 0 (any free port) to 65535")
    return int(text)
