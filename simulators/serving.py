"""A simulated box served to anybody's client, on the device's own ports where they are free."""

from pathlib import Path

from drivers.clock import PacedClock, RealClock
from drivers.transducer import SetupError
from simulators.faults import Faults
from simulators.net_ft_box import NetFtBox
from simulators.timetable import ScriptedBench, load_timetable, usual_timetable


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
    timetable = usual_timetable() if script is None else load_timetable(script)

    def box(port: int) -> NetFtBox:
        return NetFtBox(
            ScriptedBench(seed, timetable),
            RealClock() if factor == 1.0 else PacedClock(factor),
            rate=rate,
            rdt_port=rdt_port,
            tcp_port=tcp_port,
            http_port=port,
            faults=Faults(timetable.faults, seed=seed, repeat=timetable.repeat),
        )

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
