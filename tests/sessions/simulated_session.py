"""A whole session in simulated time, with stand-ins for people and transducer."""

from datetime import UTC, datetime, timedelta

from stand_ins import INFO, Hands, ResumableClock, StandIn

from sessions.plan.protocols.planning import plan
from sessions.plan.protocols.protocol import protocol
from sessions.recording import Recording, SessionWriter, provenance
from sessions.run.resuming import check_resumable, continue_clock, resumed_data, resumption
from sessions.run.runner import Continuation, run_session

PAPER = protocol("sensotact-friction")


class Session:
    """A session in simulated time, run when called."""

    def __init__(self, folder, *, forces=True, instead=None, **transducer):
        self.clock = ResumableClock()
        self.plan = plan(PAPER, "S01", 3, forces=forces)
        info = INFO if forces else None
        self.writer = SessionWriter.create(
            folder, self.plan, info, provenance(self.clock), subject_simulated=True, clock=self.clock
        )
        self.transducer = StandIn(self.clock, **transducer) if forces else None
        self.hands = Hands(self.clock, self.transducer, instead)
        self.folder = folder

    def run(self, **options):
        self.end = run_session(self.plan, self.writer, self.hands, self.transducer, **options)
        return Recording.open(self.writer.folder)


def once(*events):
    """Answer with `events` the first time, as usual afterwards."""
    queue = [list(events)]
    return lambda _: queue.pop() if queue else None


def resume(folder, **transducer):
    """Go on with the session in `folder` on a machine that was started anew."""
    recording = Recording.open(folder)
    check_resumable(recording)
    last = recording.last_block()
    now = datetime.fromisoformat(recording.provenance["created_utc"]) + timedelta(seconds=600)
    clock, gap = continue_clock(recording, last, ResumableClock(5_000), now.astimezone(UTC))
    simulated_clock = ResumableClock(clock.now_ns())
    device = StandIn(simulated_clock, **transducer)
    at = resumption(recording.plan, recording.events)
    writer = SessionWriter.open(folder, simulated_clock)
    resumed = Continuation(at, resumed_data(gap, device.info, {}), last)
    end = run_session(recording.plan, writer, Hands(simulated_clock, device), device, resumed=resumed)
    return end, Recording.open(folder)
