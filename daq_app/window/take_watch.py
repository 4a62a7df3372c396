"""Has the last stroke looked at while its stimulus is still mounted, in a process of its own."""

from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from importlib import import_module

from daq_app.child_process import give_way, process_pool
from daq_app.recorder import messages as m
from daq_app.window.live_feed import LiveFeed
from daq_app.window.messages import DrawingFailed, Judged
from daq_app.window.state import AppState
from daq_app.window.stroke_quality import Quality, in_newtons, stroke_quality
from daq_app.wording import tr
from sessions.recording import LoggedEvent
from sessions.run import steps

AFTER = 0.35  # unloaded readings after a lift that belong to the picture of a stroke [s]


class Judge:
    """Watches the takes that pass, and says of each stroke how good it was."""

    def __init__(self, say: Callable[[Judged | DrawingFailed], None]) -> None:
        """Tell by `say`, from another thread."""
        self._say = say
        self._worker: ProcessPoolExecutor | None = None
        self._take: tuple[int, int] | None = None  # trial and take in hand
        self._offset = 0.0  # of the times in the log to those of the stream [s]
        self._due: float | None = None  # when the take is to be looked at [s, device time]

    def prepare(self) -> None:
        """Start the process, so that the first stroke need not wait for it."""
        if self._worker is None:
            self._worker = process_pool(1)
            self._worker.submit(_warm)

    def close(self) -> None:
        """Let go of the process."""
        if self._worker is not None:
            self._worker.shutdown(wait=False, cancel_futures=True)

    def heard(self, report: m.Report, feed: LiveFeed) -> None:
        """Follow the course: a take begins, the finger lifts."""
        match report:
            case steps.StartTake(trial, take):
                self._take, self._due = (trial, take), None
                feed.take_begins()
            case LoggedEvent(kind="finger_lifted", data=data):
                self._due = float(data["time"]) - self._offset + AFTER
            case LoggedEvent(kind="readings_joined", data=data):
                self._offset = float(data["time_offset"])
            case m.SessionBegun():
                self._offset, self._due = 0.0, None
            case LoggedEvent(kind="contact_onset"):
                self._due = None
            case _:
                pass

    def look(self, feed: LiveFeed, state: AppState) -> None:
        """Have the take looked at once enough came after the lift."""
        newest, session, info = feed.trace.newest, state.session, state.bench.info
        if self._due is None or newest is None or newest < self._due:
            return
        self._due = None
        if session is None or info is None or self._take is None:
            return
        number, take = self._take
        trial = session.of(number)
        block = feed.take()
        if trial is None or not len(block):
            return
        self.prepare()
        assert self._worker is not None
        future = self._worker.submit(stroke_quality, block, session.plan, in_newtons(info), trial.trial)
        future.add_done_callback(lambda done: self._judged(number, take, done))

    def _judged(self, number: int, take: int, done: "Future[Quality]") -> None:
        if done.cancelled():
            return
        if error := done.exception():
            self._worker = None  # the next stroke gets another
            name = type(error).__name__
            self._say(DrawingFailed(tr("the last stroke was not looked at: {name} {error}", name=name, error=error)))
            return
        self._say(Judged(number, take, done.result()))


def _warm() -> None:
    """Load what the analysis needs, and let this process go behind window and recorder."""
    give_way()
    for name in ("scipy.linalg.lapack", "scipy.special"):
        import_module(name)
