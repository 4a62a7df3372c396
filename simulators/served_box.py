"""A box that a thread of its own serves until it is closed, and such a box behind a serial line."""

import threading
from collections.abc import Callable

from drivers.clock import Clock
from simulators.faults import Faults
from simulators.pseudo_terminal import PseudoTerminal


class ServedBox:
    """One box. Its time, and the bench's, begins when it is started."""

    def __init__(self, clock: Clock, faults: Faults | None) -> None:
        """Set up a box without any fault by default."""
        self.clock = clock
        self.faults = faults or Faults()
        self.closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._origin_ns = 0

    def now(self) -> float:
        """Return the box's and the bench's time [s]: 0 when it was started."""
        return (self.clock.now_ns() - self._origin_ns) * 1e-9

    def serve(self, work: Callable[[], None], name: str) -> None:
        """Let time begin, and a thread work until `closing` is set."""
        self._origin_ns = self.clock.now_ns()
        self._thread = threading.Thread(target=work, name=f"simulated {name}")
        self._thread.start()

    def close(self) -> None:
        """Switch the box off. Harmless when repeated."""
        self.closing.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None


_NAP = 0.01  # of a box without its line or its power [real s]


class LineBox(ServedBox):
    """One box on a line."""

    is_on: bool  # by `power_up`; False: without power

    def __init__(self, name: str, clock: Clock, faults: Faults | None) -> None:
        """Set up a box whose port's path ends with `name`."""
        super().__init__(clock, faults)
        self._name = name
        self._port: PseudoTerminal | None = None

    @property
    def path(self) -> str:
        """Path of the port; known once the box is started."""
        assert self._port is not None
        return self._port.path

    def start(self) -> None:
        """Make the port and begin to serve. Raises SetupError where there are no pseudo-terminals."""
        port = self._port = PseudoTerminal(self._name)
        self.serve(lambda: self._serve(port), self._name)

    def close(self) -> None:
        """Switch the box off and remove its port. Harmless when repeated."""
        super().close()
        if self._port is not None:
            self._port.close()

    def _serve(self, port: PseudoTerminal) -> None:
        """Be the box until closed: unplugged, without power, powered up again, or at work."""
        while not self.closing.is_set():
            now = self.now()
            if self.faults.active("unplug", now):
                port.unplug()
                self.closing.wait(_NAP)
                continue
            port.plug_in()
            if self.faults.active("reboot", now):
                self.is_on = False
                port.heard(_NAP)
                continue
            if not self.is_on:
                self.power_up(now)
            self.work(port, now)

    def power_up(self, now: float) -> None:
        """Forget what is not kept over power-off; the box is on."""
        raise NotImplementedError

    def work(self, port: PseudoTerminal, now: float) -> None:
        """Send what is due, then listen for a short while and answer."""
        raise NotImplementedError
