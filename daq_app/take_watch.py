"""Has the last stroke looked at while its stimulus is still mounted, off the window's thread."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from daq_app.live_feed import LiveFeed
from daq_app.recorder import messages as m
from daq_app.state import AppState
from daq_app.stroke_quality import in_newtons, stroke_quality
from daq_app.window_messages import Judged
from drivers.readings import ReadingBlock
from drivers.transducer import TransducerInfo
from sessions import steps
from sessions.plan import SessionPlan
from sessions.recording import LoggedEvent

AFTER = 0.35  # unloaded readings after a lift that belong to the picture of a stroke [s]


class Judge:
    """Watches the takes that pass, and says of each stroke how good it was."""

    def __init__(self, say: Callable[[Judged], None]) -> None:
        """Tell by `say`, from a thread of its own."""
        self._say = say
        self._worker = ThreadPoolExecutor(1, "stroke quality")
        self._take: tuple[int, int] | None = None  # trial and take in hand
        self._offset = 0.0  # of the times in the log to those of the stream [s]
        self._due: float | None = None  # when the take is to be looked at [s, device time]

    def close(self) -> None:
        """Let go of the thread."""
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
        self._worker.submit(self._judge, feed.take(), session.plan, info, *self._take)

    def _judge(self, block: ReadingBlock, plan: SessionPlan, info: TransducerInfo, number: int, take: int) -> None:
        trial = next((t for t in plan.trials if t.number == number), None)
        if trial is None or not len(block):
            return
        self._say(Judged(number, take, stroke_quality(block, plan, in_newtons(info), trial)))
