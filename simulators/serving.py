"""The other end of every driver: the list of simulated devices, and each of them served to any client.

The list reads itself from the modules of this package. A test that is run on every driver takes it from here.
"""

import pkgutil
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path

import simulators
from drivers.clock import clock_at
from drivers.transducer import SetupError
from simulators.digital_ft_box import DigitalFtBox
from simulators.faults import Faults
from simulators.net_ft_box import NetFtBox
from simulators.serial_ft_box import SerialFtBox
from simulators.simulator import Simulator
from simulators.timetable import ScriptedBench, load_timetable, usual_timetable

_MODULES = [import_module(f"simulators.{module.name}") for module in pkgutil.iter_modules(simulators.__path__)]
SIMULATORS: Mapping[str, Simulator] = {
    module.SIMULATOR.name: module.SIMULATOR for module in _MODULES if hasattr(module, "SIMULATOR")
}


def serve_net_ft(
    *,
    rdt_port: int = 49152,
    tcp_port: int = 49151,
    http_port: int | None = None,
    rate: int = 200,
    seed: int = 0,
    factor: float = 1.0,
    script: Path | None = None,
) -> NetFtBox:
    """Return a networked box that serves on loopback until it is closed; its `uri` is the address to connect to.

    Without `http_port` it takes 80, or a free port where 80 is refused. Time runs `factor` times as fast as real.
    Raises SetupError when a port is in use or the script is missing, TimetableError when the script is wrong.
    """

    def box(port: int) -> NetFtBox:
        bench, faults = _scripted(script, seed)
        return NetFtBox(bench, clock_at(factor), rate=rate, ports=(rdt_port, tcp_port, port), faults=faults)

    if http_port is None:
        usual = box(80)
        try:
            usual.start()
        except SetupError:
            http_port = 0  # refused or taken; where another port is the trouble, the next start says so
        else:
            return usual
    served = box(http_port)
    served.start()
    return served


def serve_serial_ft(
    *, baud: int = 38400, seed: int = 0, factor: float = 1.0, script: Path | None = None
) -> SerialFtBox:
    """Return a stand-alone controller that serves on a pseudo-terminal of `baud` bits a second until it is closed.

    Raises SetupError where there are no pseudo-terminals or the script is missing, TimetableError when it is wrong.
    """
    bench, faults = _scripted(script, seed)
    box = SerialFtBox(bench, clock_at(factor), baud=baud, faults=faults)
    box.start()
    return box


def serve_digital_ft(*, seed: int = 0, factor: float = 1.0, script: Path | None = None) -> DigitalFtBox:
    """Return an RS-485 transducer that serves on a pseudo-terminal until it is closed. Raises as `serve_serial_ft`."""
    bench, faults = _scripted(script, seed)
    box = DigitalFtBox(bench, clock_at(factor), faults=faults)
    box.start()
    return box


def _scripted(script: Path | None, seed: int) -> tuple[ScriptedBench, Faults]:
    """Return the bench and the faults of a script, or of the usual timetable."""
    timetable = usual_timetable() if script is None else load_timetable(script)
    return ScriptedBench(seed, timetable), Faults(timetable.faults, seed=seed, repeat=timetable.repeat)
