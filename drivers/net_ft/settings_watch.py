"""Whether a streaming box still counts as it did when it was opened: its settings page is read again and again."""

import threading
from collections.abc import Callable

import numpy as np

from drivers.clock import Clock
from drivers.transducer import DeviceFault, SetupError, TransducerInfo

_EVERY = 0.5  # between two looks, so that a change is found within 1 s [real s]
_AGAIN = 0.05  # after a look that nobody answered
_ENDING = 0.3  # for a look under way when the watch ends; the look itself takes no longer
_TRANSFORM = "tool transform"  # name of the setting that turns and shifts what the box measures


class SettingsWatch:
    """Compares the page with what was read at opening, on a thread of its own."""

    def __init__(self, info: TransducerInfo, who: Callable[[], TransducerInfo | None], clock: Clock) -> None:
        """Watch the box of `info`. `who` returns who answers there now, soon, None when nobody does."""
        self.fault: DeviceFault | None = None  # what was found
        self.confirmed_ns = clock.now_ns()  # until then the box counted as before [ns, session clock]
        self._info = info
        self._who = who
        self._clock = clock
        self._look = threading.Event()
        self._over = threading.Event()
        self._senseless = 0  # pages in a row that make no sense
        self._thread = threading.Thread(target=self._run, name=f"settings of {info.serial}", daemon=True)

    def start(self) -> None:
        """Look from now on."""
        self._thread.start()

    def end(self) -> None:
        """Look no more."""
        self._over.set()
        self._look.set()
        self._thread.join(_ENDING)

    def look_now(self) -> None:
        """Look at once: the stream shows that something was changed."""
        self._look.set()

    def is_the_same(self) -> bool:
        """Tell whether the box answers and counts as before. Raises DeviceFault when another does, or other units."""
        began_ns = self._clock.now_ns()
        try:
            info = self._who()
            self._senseless = 0
        except SetupError as error:
            self._senseless += 1
            if self._senseless > 1:  # once it may have been cut on its way
                raise DeviceFault(f"{error}; it did when it was opened") from None
            return False
        if info is None:
            return False
        uri, serial = self._info.uri, self._info.serial
        if info.serial != serial:
            raise DeviceFault(
                f"{uri}: transducer {info.serial} answers where {serial} was; connect that one again, or open it anew"
            )
        if not np.array_equal(info.calibration.matrix, self._info.calibration.matrix):
            raise DeviceFault(
                f"{uri}: transducer {serial} counts in other units than before: {_units(info)}, not "
                f"{_units(self._info)}; open it anew"
            )
        if info.settings.get(_TRANSFORM) != self._info.settings.get(_TRANSFORM):
            raise DeviceFault(f"{uri}: the tool transform of transducer {serial} was changed on its page; open it anew")
        self.confirmed_ns = began_ns
        return True

    def _run(self) -> None:
        while not self._over.is_set():
            self._look.clear()
            try:
                answered = self.is_the_same()
            except DeviceFault as fault:
                self.fault = fault
                return
            self._look.wait(_EVERY if answered else _AGAIN)


def _units(info: TransducerInfo) -> str:
    """Return how many counts make a newton and a newton millimetre."""
    force, torque = 1.0 / info.calibration.matrix[0, 0], 1.0 / info.calibration.matrix[3, 3]
    return f"{force:.6g} counts a N and {torque:.6g} a N mm"
