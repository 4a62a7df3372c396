"""The networked force/torque box as a transducer: streaming, accounting, loss and return."""

import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.clock import Clock
from drivers.links import Link
from drivers.net_ft.wire import AXIA, NET_FT, START, STOP, decode
from drivers.rate import RateWatch, rate_words
from drivers.readings import ReadingBlock
from drivers.sequence import SequenceAccount
from drivers.threaded import ThreadedTransducer
from drivers.transducer import DeviceFault, Health, LinkLost, TransducerInfo

# All in real seconds, since networks know no other.
_TICK = 0.05  # longest wait for a datagram, and so for a stop
_ASK_EVERY = 0.1  # between two start requests while nothing comes
_PATIENCE = 3.0  # until a box that never sent anything is given up: the computer may be busy just then
_SILENCE = 3.0  # until a box that has fallen silent is given up
_QUIET = 0.3  # silence after which the box is asked to start again
_THEFTS = 3  # so many returns within _THEFT_SPAN mean that somebody else keeps taking the stream
_THEFT_SPAN = 3.0
_SILENT_TICKS = 2.0  # across a longer silence the box's counter is not held against the computer's clock
_TOGETHER = 50_000_000  # of records that arrived within, one is looked at for that [ns]


class NetFtTransducer(ThreadedTransducer):
    """One box, through a link that is opened at each start. A thread drains the link; readings are decoded when read.

    Time is (counter - first counter) / counter rate, by the box's own oscillator (good to 0.5 %). After a reboot of the
    box, sequence and time go on behind a gap whose length is taken from the session's clock.
    """

    def __init__(
        self,
        info: TransducerInfo,
        connect: Callable[[], Link],
        who: Callable[[], TransducerInfo | None],
        clock: Clock,
        request: bytes = START,
    ) -> None:
        """Take an identified box. `who` tells who answers there now, soon, None when nobody does: asked in a silence.

        `request` asks for the stream.
        """
        self._request = request
        self._invalid = (AXIA if "axia" in info.model.lower() else NET_FT).invalid
        super().__init__(info, clock)
        self._connect = connect
        self._who = who
        self._step = round(info.counter_rate / info.rate) if info.rate > 0.0 else None  # nan: learn it
        self._period = 1.0 / info.rate / clock.factor if info.rate > 0.0 else 0.0  # between two readings [real s]
        self._pending: deque[tuple[bytes, int]] = deque()  # datagrams with their arrival [ns], from the thread
        self._reset()

    @property
    def health(self) -> Health:
        """Totals since start, of all that has arrived up to now."""
        with self._lock:
            self._digest()
            account = self._account
            found = [self._rate_found()] if account.changed else []
            found += (
                [rate_words("its clock runs", self._watch.rate, self._info.counter_rate)] if self._watch.found else []
            )
            return Health(
                received=self._received,
                lost=account.lost,
                repeated=account.repeated,
                late=account.late,
                malformed=self._wrong_length + account.garbage,
                stalled=account.frozen,
                restarted=account.restarted,
                saturated=self._saturated,
                off_rate=account.changed + self._watch.found,
                rate_words="; ".join(found),
                lag_ms=self._lag_ms,
            )

    def start(self) -> None:
        """Ask for the stream until it comes. Raises LinkLost when it does not, DeviceFault when its rate is wrong."""
        self._reset()
        link = self._connect()
        self._thread = threading.Thread(target=self._drain, args=(link,), name=f"net-ft {self._info.serial}")
        self._thread.start()
        patience = _PATIENCE + 4.0 * self._period
        waited = 0.0
        while self.health.received == 0:
            waited += 0.0 if self._arrived.wait(_TICK) else _TICK
            self._arrived.clear()
            if self._ended is not None or waited > patience:
                self.stop()
                raise self._ended or LinkLost(self._never_came(patience))
        if self._step is not None and self._account.step not in (None, self._step):
            self.stop()
            raise DeviceFault(
                f"{self._info.uri} is set to {self._info.rate:g} Hz but sends "
                f"{self._info.counter_rate / (self._account.step or 1):g} Hz; switch it off and on, then open it again"
            )

    def _reset(self) -> None:
        """Forget what an earlier stream left."""
        super()._reset()
        self._pending.clear()
        self._account = SequenceAccount(self._step, self._info.counter_rate)
        self._watch = RateWatch(self._info.counter_rate, self._clock.factor, _SILENT_TICKS * self._clock.factor)
        self._breaks = 0  # in the device's counter, so far
        self._held: list[tuple[bytes, int]] = []
        self._zero: int | None = None  # counter of the first reading
        self._received = self._wrong_length = self._saturated = 0

    def _drain(self, link: Link) -> None:
        """Be the receiving thread: ask for the stream, take what comes, ask again when it falls silent, and end it."""
        try:
            self._listen(link)
        except (LinkLost, DeviceFault) as error:
            self._ended = error
        finally:
            try:
                link.send(STOP)
                link.send(STOP)  # it is not acknowledged and may be lost; a second one does no harm
                while (datagram := link.receive(0.0)) is not None:
                    self._pending.append((datagram, self._clock.now_ns()))
            except LinkLost:
                pass
            link.close()
            self._arrived.set()

    def _listen(self, link: Link) -> None:
        """Take datagrams until told to stop, or until the box has been silent for too long."""
        receive, keep, now_ns = link.receive, self._pending.append, self._clock.now_ns
        link.send(self._request)
        # Silence is counted in waits that brought nothing, so that a computer too busy to look is not taken for it.
        silence = asked = 0.0
        streaming = ever = False
        returns: deque[float] = deque(maxlen=_THEFTS)
        while not self._stopping.is_set():
            datagram = receive(_TICK)
            if datagram is not None:
                keep((datagram, now_ns()))
                if not self._arrived.is_set():
                    self._arrived.set()
                silence, asked, streaming, ever = 0.0, 0.0, True, True
                continue
            silence += _TICK
            if silence > _SILENCE + 4.0 * self._period:
                raise LinkLost(self._fell_silent(silence))
            if silence - asked < (_QUIET if streaming else _ASK_EVERY) + 2.0 * self._period:
                continue
            if streaming:
                returns.append(time.monotonic())
                if len(returns) == _THEFTS and returns[-1] - returns[0] < _THEFT_SPAN:
                    raise LinkLost(
                        f"{self._info.uri} stopped sending {_THEFTS} times within {_THEFT_SPAN:g} s; "
                        "another program on the network probably takes its stream: end that program"
                    )
            if not ever or self._is_the_same():
                link.send(self._request)
            asked, streaming = silence, False

    def _is_the_same(self) -> bool:
        """Tell whether the box answers again. Raises DeviceFault when another one does, or when it is set anew."""
        found = self._who()
        if found is None:
            return False
        if found.serial != self._info.serial:
            raise DeviceFault(
                f"{self._info.uri}: transducer {found.serial} answers where {self._info.serial} was; "
                "connect that one again, or open it anew"
            )
        if not np.array_equal(found.calibration.matrix, self._info.calibration.matrix):
            raise DeviceFault(
                f"{self._info.uri}: transducer {found.serial} counts in other units than before; open it anew"
            )
        return True

    def _digest(self, *, end: bool = False) -> None:
        """Turn pending datagrams into accounted readings. The lock is held."""
        if not self._pending and not (end and self._held):
            return
        arrived = self._held
        while self._pending:
            arrived.append(self._pending.popleft())
        decoded = decode([datagram for datagram, _ in arrived])
        self._wrong_length += decoded.malformed
        origin: list[int] = decoded.origin.tolist()
        received_ns = [arrived[i][1] for i in origin]
        records = decoded.records
        numbers, counters = records["number"].astype(np.uint32), records["counter"].astype(np.uint32)
        verdict = self._account.take(numbers, counters, received_ns, end=end)
        self._held = [arrived[origin[-1]]] if verdict.held else []
        if not len(verdict.kept):
            return
        if self._zero is None:
            self._zero = int(verdict.counter[0])
        kept = records[verdict.kept]
        status = kept["status"].astype(np.int64)
        self._received += len(kept)
        arrived_ns = np.array(received_ns, np.int64)[verdict.kept]
        self._compare_clocks(verdict.counter, arrived_ns)
        self._saturated += int(np.count_nonzero(status & self._invalid))
        self._ready.append(
            ReadingBlock(
                sequence=verdict.sequence,
                counter=verdict.counter,
                status=status,
                time=(verdict.counter - self._zero) / self._info.counter_rate,
                received_ns=arrived_ns,
                raw=kept["counts"].astype(np.float64),
            )
        )

    def _compare_clocks(self, counter: NDArray[np.int64], received_ns: NDArray[np.int64]) -> None:
        """Hold the box's counter against the session's clock."""
        breaks = self._account.restarted + self._account.frozen
        if breaks != self._breaks:  # it stood still, or began anew
            self._breaks = breaks
            self._watch.begin_anew()
            return
        apart = max(len(counter) // 16, 1) if int(received_ns[-1] - received_ns[0]) > _TOGETHER else len(counter)
        for i in range((len(counter) - 1) % apart, len(counter), apart):
            self._watch.take(int(counter[i]), int(received_ns[i]))

    def _rate_found(self) -> str:
        """Return at which rate the box sends now."""
        return rate_words("it sends", self._info.counter_rate / (self._account.step or 1), self._info.rate)

    def _never_came(self, patience: float) -> str:
        """Return why a start failed."""
        if self._who() is not None:
            return (
                f"{self._info.uri} answers on its web page but sent no reading within {patience:.1f} s; "
                "check that no firewall holds back its UDP datagrams"
            )
        return f"{self._info.uri} sent no reading within {patience:.1f} s; check its power and network cable"

    def _fell_silent(self, seconds: float) -> str:
        """Return why a running stream was given up."""
        if self._who() is not None:
            return (
                f"{self._info.uri} has sent nothing for {seconds:.1f} s though its web page still answers; "
                "end any other program that reads it, and check for a firewall"
            )
        return f"{self._info.uri} has sent nothing for {seconds:.1f} s; check its power and network cable"
