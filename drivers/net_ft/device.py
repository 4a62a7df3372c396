"""The networked force/torque box as a transducer: streaming, accounting, loss and reconnection."""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np

from drivers.arrays import Indices
from drivers.clock import Clock
from drivers.clock_recovery import RateWatch, rate_words
from drivers.deadline import ENDING, Connect, Deadline, Link
from drivers.net_ft.wire import START, STOP, decode
from drivers.readings import ReadingBlock
from drivers.sequence import SequenceAccount
from drivers.threaded import ThreadedTransducer
from drivers.transducer import DeviceFault, Health, LinkLost, SetupError, TransducerInfo

_EVERY = 0.5  # between two checks, so that a change is detected within 1 s [real s]
_AGAIN = 0.05  # after a check without an answer
_ENDING = 0.3  # for a check in progress when the watch ends; no check takes longer
_TRANSFORM = "tool transform"  # name of the setting that rotates and shifts the box's wrench


class _SettingsWatch:
    """Compares the page with its content at opening, in a separate thread."""

    def __init__(self, info: TransducerInfo, identify: Callable[[], TransducerInfo | None], clock: Clock) -> None:
        """Watch the box of `info`. `identify` quickly returns the info of the box that answers now, or None."""
        self.fault: Exception | None = None  # a changed setting, or an internal error
        self.confirmed_ns = clock.now_ns()  # until then the units are confirmed [ns, session clock]
        self._info = info
        self._identify = identify
        self._clock = clock
        self.look = threading.Event()  # set: check immediately, since the stream shows a change
        self._stop = threading.Event()
        self._senseless = 0  # invalid pages in a row
        self._thread = threading.Thread(target=self._run, name=f"settings of {info.serial}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def end(self) -> None:
        self._stop.set()
        self.look.set()
        self._thread.join(_ENDING)

    def is_the_same(self) -> bool:
        """Say whether the box answers with the same settings. Raises DeviceFault for another box or other settings."""
        began_ns = self._clock.now_ns()
        try:
            info = self._identify()
            self._senseless = 0
        except SetupError as error:
            self._senseless += 1
            if self._senseless > 1:  # a single page may have been truncated on its way
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
        while not self._stop.is_set():
            self.look.clear()
            try:
                is_same = self.is_the_same()
            except Exception as fault:  # noqa: BLE001 - units that are no longer watched must not look confirmed
                self.fault = fault
                return
            self.look.wait(_EVERY if is_same else _AGAIN)


def _units(info: TransducerInfo) -> str:
    force, torque = 1.0 / info.calibration.matrix[0, 0], 1.0 / info.calibration.matrix[3, 3]
    return f"{force:.6g} counts a N and {torque:.6g} a N mm"


# All in real seconds, the time of networks.
_TICK = 0.05  # longest wait for a datagram, and so the longest delay of a stop
_ASK_EVERY = 0.1  # between two start requests while nothing arrives
_SILENCE = 3.0  # until a silent box is given up
_QUIET = 0.3  # silence after which the box is asked to start again
_THEFTS = 3  # restarts within _THEFT_SPAN from which another client is assumed to take the stream
_THEFT_SPAN = 3.0
_SILENT_TICKS = 2.0  # a longer silence suspends the comparison of the box's counter with the computer's clock
_TOGETHER = 50_000_000  # interval of compared records [ns]


class NetFtTransducer(ThreadedTransducer):
    """One box, through a link that is opened at each start. A thread empties the link; readings are decoded on reading.

    Time is (counter - first counter) / counter rate, by the box's own oscillator (good to 0.5 %). After a reboot of the
    box, sequence and time continue after a gap measured by the session's clock.
    """

    def __init__(
        self,
        info: TransducerInfo,
        connect: Connect,
        identify: Callable[[], TransducerInfo | None],
        clock: Clock,
        request: bytes = START,
        *,
        opening: Deadline | None = None,
    ) -> None:
        """Take an identified box, opened within `opening`. `request` starts the stream.

        `identify` quickly returns the info of the box that answers now, or None; it is called repeatedly.
        """
        super().__init__(info, clock, opening)
        self._request = request
        self._connect = connect
        self._identify = identify
        self._step = round(info.counter_rate / info.rate) if info.rate > 0.0 else None  # nan: learned from the stream
        self._period = 1.0 / info.rate / clock.factor if info.rate > 0.0 else 0.0  # between two readings [real s]
        self.reset()

    @property
    def health(self) -> Health:
        """Totals since start, of everything that has arrived."""
        with self.lock:
            self.digest()
            account = self._account
            info, sends = self.info, self.info.counter_rate / (account.step or 1)
            sentences = [rate_words("it sends", sends, info.rate)] if account.changed else []
            if self._watch.changes:
                sentences.append(rate_words("its clock runs", self._watch.rate, info.counter_rate))
            return self.totals(
                lost=account.lost,
                repeated=account.repeated,
                late=account.late,
                malformed=self._wrong_length + account.garbage,
                stalled=account.frozen,
                restarted=account.restarted,
                off_rate=account.changed + self._watch.changes,
                rate_words="; ".join(sentences),
                off_units=0 if self._settings.fault is None else sum(count for _, count in self._unconfirmed),
            )

    def has_come(self) -> bool:
        return self.health.received > 0

    def check_first(self) -> None:
        """Raise an error if the stream is unusable; DeviceFault when its rate is wrong."""
        super().check_first()
        if self._step is not None and self._account.step not in (None, self._step):
            raise DeviceFault(
                f"{self.info.uri} is set to {self.info.rate:g} Hz but sends "
                f"{self.info.counter_rate / (self._account.step or 1):g} Hz; switch it off and on, then open it again"
            )

    def reset(self) -> None:
        super().reset()
        self._pending: deque[tuple[bytes, int]] = deque()  # datagrams with their arrival [ns], from the thread
        self._account = SequenceAccount(self._step, self.info.counter_rate)
        self._watch = RateWatch(self.info.counter_rate, self.clock.factor, _SILENT_TICKS * self.clock.factor)
        self._breaks = self._changes = 0  # breaks of the device's counter, and changes of it or of the rate, so far
        self._held_back: list[tuple[bytes, int]] = []
        self._zero: int | None = None  # counter of the first reading
        self._wrong_length = 0
        self._settings = _SettingsWatch(self.info, self._identify, self.clock)
        self._unconfirmed: deque[tuple[int, int]] = deque()  # last arrival [ns] and number of unconfirmed ones

    def run(self) -> None:
        """Start the stream, take datagrams, restart it when it falls silent, and end it."""
        link = self._connect(self.begin_by)
        try:
            self._settings.start()
            self._listen(link)
        finally:
            self._take_leave(Deadline(ENDING).bound(link))
            self._settings.end()

    def _take_leave(self, link: Link) -> None:
        """End the stream, and take the datagrams already sent."""
        with contextlib.suppress(LinkLost):
            link.send(STOP)
            link.send(STOP)  # a stop is not acknowledged and may be lost; a second one is harmless
            while (datagram := link.receive(0.0)) is not None:
                self._pending.append((datagram, self.clock.now_ns()))
        link.close()

    def _listen(self, link: Link) -> None:
        """Take datagrams until a stop, or until the box has been silent for too long."""
        receive, keep, now_ns = link.receive, self._pending.append, self.clock.now_ns
        link.send(self._request)
        # Silence is counted in waits without data, so that a busy computer is not mistaken for silence.
        silence = last_request = 0.0
        streaming = ever = False
        returns: deque[float] = deque(maxlen=_THEFTS)
        while not self.stopping.is_set():
            if self._settings.fault is not None:
                raise self._settings.fault
            datagram = receive(_TICK)
            if datagram is not None:
                keep((datagram, now_ns()))
                if not self.news.is_set():
                    self.news.set()
                silence, last_request, streaming, ever = 0.0, 0.0, True, True
                continue
            silence += _TICK
            if silence > _SILENCE + 4.0 * self._period:
                raise LinkLost(self._fell_silent(silence))
            if silence - last_request < (_QUIET if streaming else _ASK_EVERY) + 2.0 * self._period:
                continue
            if streaming:
                returns.append(time.monotonic())
                if len(returns) == _THEFTS and returns[-1] - returns[0] < _THEFT_SPAN:
                    raise LinkLost(
                        f"{self.info.uri} stopped sending {_THEFTS} times within {_THEFT_SPAN:g} s; "
                        "another program on the network probably takes its stream: end that program"
                    )
            if not ever or self._settings.is_the_same():
                link.send(self._request)
            last_request, streaming = silence, False

    def digest(self, *, end: bool = False) -> None:
        if not self._pending and not (end and self._held_back):
            return
        datagrams = self._held_back
        while self._pending:
            datagrams.append(self._pending.popleft())
        batch = decode([datagram for datagram, _ in datagrams])
        self._wrong_length += batch.malformed
        origin: list[int] = batch.origin.tolist()
        received_ns = [datagrams[i][1] for i in origin]
        records = batch.records
        numbers, counters = records["number"].astype(np.uint32), records["counter"].astype(np.uint32)
        verdict = self._account.take(numbers, counters, received_ns, end=end)
        self._held_back = [datagrams[origin[-1]]] if verdict.undecided else []
        if not len(verdict.positions):
            return
        if self._zero is None:
            self._zero = int(verdict.counter[0])
        valid = records[verdict.positions]
        status = valid["status"].astype(np.int64)
        arrived_ns = np.array(received_ns, np.int64)[verdict.positions]
        self._compare_clocks(verdict.counter, arrived_ns)
        self._compare_settings(int(arrived_ns[-1]), len(valid))
        self.hand_over(
            ReadingBlock(
                sequence=verdict.sequence,
                counter=verdict.counter,
                status=status,
                time=(verdict.counter - self._zero) / self.info.counter_rate,
                received_ns=arrived_ns,
                raw=valid["counts"].astype(np.float64),
            )
        )

    def _compare_clocks(self, counter: Indices, received_ns: Indices) -> None:
        breaks = self._account.restarted + self._account.frozen
        if breaks != self._breaks:  # it was frozen, or restarted
            self._breaks = breaks
            self._watch.begin_anew()
            return
        apart = max(len(counter) // 16, 1) if int(received_ns[-1] - received_ns[0]) > _TOGETHER else len(counter)
        for i in range((len(counter) - 1) % apart, len(counter), apart):
            self._watch.take(int(counter[i]), int(received_ns[i]))

    def _compare_settings(self, received_ns: int, count: int) -> None:
        """Count readings with unconfirmed units, and request a check where rate or counter has changed."""
        changes = self._account.changed + self._account.restarted + self._watch.changes
        if changes != self._changes:
            self._changes = changes
            self._settings.look.set()
        while self._unconfirmed and self._unconfirmed[0][0] < self._settings.confirmed_ns:
            self._unconfirmed.popleft()
        self._unconfirmed.append((received_ns, count))

    def never_came(self, seconds: float) -> str:
        health = self.health
        if senseless := health.malformed + health.repeated + health.late + len(self._held_back):
            return (
                f"{self.info.uri} sent {senseless} records within {seconds:.1f} s of which none is a reading: of a "
                "wrong length, or numbers that stand still; switch the box off and on, and check the rdt port"
            )
        if self._answers():
            return (
                f"{self.info.uri} answers on its web page but sent no reading within {seconds:.1f} s; "
                "check that no firewall holds back its UDP datagrams"
            )
        return f"{self.info.uri} sent no reading within {seconds:.1f} s; check its power and network cable"

    def _answers(self) -> bool:
        try:
            return self._identify() is not None
        except SetupError:
            return True

    def _fell_silent(self, seconds: float) -> str:
        if self._answers():
            return (
                f"{self.info.uri} has sent nothing for {seconds:.1f} s though its web page still answers; "
                "end any other program that reads it, and check for a firewall"
            )
        return f"{self.info.uri} has sent nothing for {seconds:.1f} s; check its power and network cable"
