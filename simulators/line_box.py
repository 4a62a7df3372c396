"""A box behind a serial line: its time, its thread, and the pseudo-terminal that it serves on."""

import threading

from drivers.clock import Clock
from simulators.faults import Faults
from simulators.pseudo_terminal import PseudoTerminal

_NAP = 0.01  # of a box without its line or its power [real s]


class LineBox:
    """One box. Its time, and the bench's, begins when it is started."""

    _on: bool  # by `_power_up`; False: without power

    def __init__(self, name: str, clock: Clock, faults: Faults | None) -> None:
        """Set up a box whose port's path ends with `name`."""
        self._name = name
        self._clock = clock
        self._faults = faults or Faults()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._port: PseudoTerminal | None = None
        self._origin_ns = 0

    @property
    def path(self) -> str:
        """Path of the port; known once the box is started."""
        assert self._port is not None
        return self._port.path

    def now(self) -> float:
        """Return the box's and the bench's time [s]: 0 when it was started."""
        return (self._clock.now_ns() - self._origin_ns) * 1e-9

    def start(self) -> None:
        """Make the port and begin to serve. Raises SetupError where there are no pseudo-terminals."""
        self._port = PseudoTerminal(self._name)
        self._origin_ns = self._clock.now_ns()
        self._thread = threading.Thread(target=self._serve, args=(self._port,), name=f"simulated {self._name}")
        self._thread.start()

    def close(self) -> None:
        """Switch the box off and remove its port. Harmless when repeated."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._port is not None:
            self._port.close()

    def _serve(self, port: PseudoTerminal) -> None:
        """Be the box until closed: unplugged, without power, powered up again, or at work."""
        while not self._closing.is_set():
            now = self.now()
            if self._faults.active("unplug", now):
                port.unplug()
                self._closing.wait(_NAP)
                continue
            port.plug_in()
            if self._faults.active("reboot", now):
                self._on = False
                port.heard(_NAP)
                continue
            if not self._on:
                self._power_up(now)
            self._work(port, now)

    def _power_up(self, now: float) -> None:
        """Forget what is not kept over power-off; the box is on."""
        raise NotImplementedError

    def _work(self, port: PseudoTerminal, now: float) -> None:
        """Send what is due, then listen for a short while and answer."""
        raise NotImplementedError
